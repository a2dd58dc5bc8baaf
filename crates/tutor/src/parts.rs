//! What the object's annotation says: its class and its parts.

use nalgebra::{Point3, UnitVector3};
use prehend_geometry::OrientedBox;

use crate::Task;

/// The annotated parts of an object, in the object frame, metres. A part is the surface inside the union of its boxes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Parts {
    /// Where a container is filled and emptied.
    pub opening: Option<Opening>,
    /// What the user holds.
    pub handle: Vec<OrientedBox>,
    /// What does the work: a hammer's head, a blade, a screwdriver's shaft and tip, a vessel's body.
    pub functional: Vec<OrientedBox>,
    /// What a receiver must not be offered.
    pub sharp: Vec<OrientedBox>,
}

/// A disc: the rim of a container.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opening {
    /// Centre of the disc.
    pub center: Point3<f64>,
    /// Out of the vessel.
    pub normal: UnitVector3<f64>,
    /// Radius, m; positive.
    pub radius: f64,
}

/// What kind of thing the object is, as far as tasks go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ObjectClass {
    /// Holds liquid: can be poured from, given its opening.
    Container,
    /// Does work on other things: can be used, given its handle and functional part.
    Tool,
    /// Neither: can only be handed over.
    Other,
}

impl ObjectClass {
    /// The class of an object type such as `mug`; for a type not known here, what its parts speak for: an opening for
    /// a container, otherwise handle and functional part for a tool.
    pub fn of(object_type: &str, parts: &Parts) -> Self {
        match object_type {
            "bottle" | "glass" | "mug" | "cup" | "jug" | "pitcher" | "flask" | "can" => Self::Container,
            "hammer" | "knife" | "screwdriver" | "wrench" | "spatula" | "spoon" => Self::Tool,
            _ if parts.opening.is_some() => Self::Container,
            _ if !parts.handle.is_empty() && !parts.functional.is_empty() => Self::Tool,
            _ => Self::Other,
        }
    }

    /// The tasks that an object of this class with these parts affords. Hand-over always is.
    pub fn affords(self, parts: &Parts) -> Vec<Task> {
        let mut tasks = vec![Task::HandOver];
        if self == Self::Container && parts.opening.is_some() {
            tasks.push(Task::Pouring);
        }
        if self == Self::Tool && !parts.handle.is_empty() && !parts.functional.is_empty() {
            tasks.push(Task::ToolUse);
        }
        tasks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_container_without_an_opening_only_affords_hand_over() {
        assert_eq!(
            ObjectClass::Container.affords(&Parts::default()),
            [Task::HandOver]
        );
    }

    #[test]
    fn an_unknown_type_is_classed_by_its_parts() {
        let part = OrientedBox::centered([1.0, 1.0, 1.0]);
        let tool = Parts {
            handle: vec![part],
            functional: vec![part],
            ..Parts::default()
        };
        assert_eq!(ObjectClass::of("trowel", &tool), ObjectClass::Tool);
        assert_eq!(ObjectClass::of("trowel", &Parts::default()), ObjectClass::Other);
        assert_eq!(ObjectClass::of("mug", &tool), ObjectClass::Container);
    }
}
