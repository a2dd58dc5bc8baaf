//! Why a stage could not run.

use std::path::{Path, PathBuf};

/// Why a stage could not run. Every message says which file or item, what was found, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error("{path}: {message}")]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What the system said, or what was found and what was expected.
        message: String,
    },

    /// An input means something that the stage cannot work with.
    #[error("{0}")]
    Input(String),

    /// The user stopped the run; finished work stays on disk.
    #[error("stopped; what was finished is kept, and the same command goes on from there")]
    Stopped,

    /// The tables or the network do not fit a model.
    #[error(transparent)]
    Model(#[from] prehend_model::ModelError),
}

impl Error {
    /// An error about one file.
    pub fn file(path: &Path, message: impl ToString) -> Self {
        Self::File {
            path: path.to_owned(),
            message: message.to_string(),
        }
    }

    /// An error about an input that is no file.
    pub fn input(message: impl ToString) -> Self {
        Self::Input(message.to_string())
    }
}
