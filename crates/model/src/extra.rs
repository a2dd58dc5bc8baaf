//! Keys of a model file that mean nothing to this crate and are kept as they are.

use serde_json::{Map, Value};

use crate::error::ModelError;

/// Further keys of a file with their values as JSON, for example `provenance`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Extra(Map<String, Value>);

impl Extra {
    pub(crate) fn new(keys: Map<String, Value>) -> Self {
        Self(keys)
    }

    pub(crate) fn keys(&self) -> &Map<String, Value> {
        &self.0
    }

    /// The value of a key as JSON text; `None` where the file has no such key.
    pub fn get(&self, key: &str) -> Option<String> {
        self.0.get(key).map(Value::to_string)
    }

    /// The same keys with one more, or another value of it.
    ///
    /// # Errors
    ///
    /// [`ModelError::ModelFile`] where the text is no JSON.
    pub fn with(mut self, key: &str, json: &str) -> Result<Self, ModelError> {
        self.0.insert(key.into(), parse(&format!("`{key}`"), json)?);
        Ok(self)
    }
}

/// JSON text as a value.
pub(crate) fn parse(place: &str, json: &str) -> Result<Value, ModelError> {
    serde_json::from_str(json).map_err(|e| ModelError::ModelFile {
        place: place.into(),
        problem: format!("{e}; expected JSON"),
    })
}
