//! How a box is written where people and other programs read it.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::{MinimumBox, OrientedBox};

/// A box with its volume, in the layout of the program's JSON.
///
/// Reading one back as an [`OrientedBox`] is possible where every extent is positive; `volume` is then ignored.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BoxRecord {
    /// Centre.
    pub center: [f64; 3],
    /// Three unit rows, right-handed.
    pub axes: [[f64; 3]; 3],
    /// Full lengths along the axes; 0 where the shape is flat.
    pub extents: [f64; 3],
    /// Product of the extents.
    pub volume: f64,
}

impl From<&OrientedBox> for BoxRecord {
    fn from(b: &OrientedBox) -> Self {
        let axes = std::array::from_fn(|k| b.axis(k).into());
        Self {
            center: b.center().coords.into(),
            axes,
            extents: b.extents().into(),
            volume: b.volume(),
        }
    }
}

impl From<&MinimumBox> for BoxRecord {
    fn from(b: &MinimumBox) -> Self {
        let axes = std::array::from_fn(|k| Vector3::from(b.axes.matrix().column(k)).into());
        Self {
            center: b.center.coords.into(),
            axes,
            extents: b.extents.into(),
            volume: b.volume(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_reads_back_as_the_box_it_came_from() {
        let original = OrientedBox::centered([1.0, 2.0, 0.5]);
        let text = serde_json::to_string(&BoxRecord::from(&original)).unwrap();
        assert!(
            text.ends_with(r#""extents":[1.0,2.0,0.5],"volume":1.0}"#),
            "{text}"
        );
        assert_eq!(serde_json::from_str::<OrientedBox>(&text).unwrap(), original);
    }
}
