//! What a `Frontier` is made of: facets that know where their edges end, the places where a point cuts them, and the table
//! in which new facets find their neighbours.

use crate::edges::{Planes, Row};

/// A facet, with the planes of its edges' ends beside its own.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(crate) struct Facet {
    /// One column a plane; `planes[r][k]` for k < 6 lies at the end of the edge that leaves `corners[k]`.
    pub(crate) planes: Planes,
    pub(crate) corners: [u16; 6],
    /// The facet (and its slot) that an edge ends at.
    pub(crate) links: [Link; 6],
}

/// A facet and one of its slots, packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Link(u32);

impl Link {
    /// The edge ends at a far plane.
    pub(crate) const FAR: Self = Self(u32::MAX);
    pub(crate) const UNSET: Self = Self(u32::MAX - 1);

    pub(crate) fn new(place: usize, slot: usize) -> Self {
        Self((place as u32) << 3 | slot as u32)
    }

    pub(crate) fn is_facet(self) -> bool {
        self.0 < Self::UNSET.0
    }

    pub(crate) fn place(self) -> usize {
        (self.0 >> 3) as usize
    }

    pub(crate) fn slot(self) -> usize {
        (self.0 & 7) as usize
    }
}

/// Where a new point cuts an edge between near and far, or near and near.
#[derive(Debug, Clone)]
pub(crate) struct Crossing {
    pub(crate) plane: Row,
    /// The plane at the seen end, and the point's height over it.
    pub(crate) seen: Row,
    pub(crate) height: f64,
    /// The facet that the edge belongs to, whether that one is seen, and the edge's slot.
    pub(crate) base: u32,
    pub(crate) base_is_seen: bool,
    pub(crate) slot: usize,
}

/// The first facet with a ridge, in a table by the ridge's fingerprint.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    pub(crate) ridge: u64,
    /// The insertion that wrote this.
    pub(crate) round: u64,
    pub(crate) link: Link,
}

impl Default for Entry {
    fn default() -> Self {
        Self {
            ridge: 0,
            round: 0,
            link: Link::UNSET,
        }
    }
}

/// 64 well-mixed bits of a number (Steele, Lea, Flood: SplitMix, OOPSLA 2014).
pub(crate) fn fingerprint(number: u64) -> u64 {
    let mut z = number.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}
