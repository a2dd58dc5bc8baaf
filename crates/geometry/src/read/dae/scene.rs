//! The tree of nodes of a COLLADA scene.

use std::collections::BTreeMap;

use nalgebra::{Matrix4, Unit, Vector3};
use roxmltree::Node;

use super::FORMAT;
use super::geometry;
use super::xml::{Xml, child, children};
use crate::read::assembly::Assembly;
use crate::read::text::quoted;
use crate::{GeometryError, TriMesh};

/// Nodes may stand for others, those for others again: more placements than this, or a longer chain, is a mistake.
const MOST_PLACEMENTS: usize = 100_000;
const DEEPEST: usize = 500;

/// The mesh of the scene that the file names, else of its first scene, else of all its geometries as they stand.
pub(super) fn read<'a>(xml: &Xml<'a, '_>, root: Node<'a, '_>) -> Result<TriMesh, GeometryError> {
    Reader {
        xml,
        assembly: Assembly::new(FORMAT),
        parts: BTreeMap::new(),
    }
    .read(root)
}

struct Reader<'x, 'a, 'i> {
    xml: &'x Xml<'a, 'i>,
    assembly: Assembly,
    /// Geometries that have been read: a file may place one often.
    parts: BTreeMap<u32, Option<TriMesh>>,
}

impl<'a, 'i> Reader<'_, 'a, 'i> {
    fn read(mut self, root: Node<'a, 'i>) -> Result<TriMesh, GeometryError> {
        let instance = child(root, "scene").and_then(|scene| child(scene, "instance_visual_scene"));
        let scene = match instance {
            Some(instance) => Some(self.xml.named(instance, "url")?),
            None => child(root, "library_visual_scenes").and_then(|library| child(library, "visual_scene")),
        };
        let Some(scene) = scene else {
            for library in children(root, "library_geometries") {
                for part in children(library, "geometry") {
                    self.place(part, &Matrix4::identity())?;
                }
            }
            return self.assembly.into_mesh();
        };
        let mut open = vec![(scene, Matrix4::identity(), 0)];
        let mut n_placed = 0;
        while let Some((node, scene_from_parent, depth)) = open.pop() {
            n_placed += 1;
            if n_placed > MOST_PLACEMENTS || depth > DEEPEST {
                let found = format!("more than {MOST_PLACEMENTS} nodes or {DEEPEST} levels");
                return Err(self.xml.error(node, found, "a scene without cycles"));
            }
            let scene_from_node = scene_from_parent * self.parent_from_node(node)?;
            let first = open.len();
            for element in node.children() {
                match element.tag_name().name() {
                    "node" => open.push((element, scene_from_node, depth + 1)),
                    "instance_node" => {
                        open.push((self.xml.named(element, "url")?, scene_from_node, depth + 1));
                    }
                    "instance_geometry" => self.place(self.xml.named(element, "url")?, &scene_from_node)?,
                    "instance_controller" => {
                        self.place_skin(self.xml.named(element, "url")?, &scene_from_node)?;
                    }
                    _ => {}
                }
            }
            // The last one is taken first: turned round, nodes come in the order of the file.
            open[first..].reverse();
        }
        self.assembly.into_mesh()
    }

    fn place(&mut self, part: Node<'a, 'i>, scene_from_part: &Matrix4<f64>) -> Result<(), GeometryError> {
        if !self.parts.contains_key(&part.id().get()) {
            let mesh = geometry::read(self.xml, part)?;
            self.parts.insert(part.id().get(), mesh);
        }
        match &self.parts[&part.id().get()] {
            Some(mesh) => self.assembly.place(mesh, scene_from_part),
            None => Ok(()),
        }
    }

    /// The geometry of a skin, where it was bound.
    fn place_skin(
        &mut self,
        controller: Node<'a, 'i>,
        scene_from_node: &Matrix4<f64>,
    ) -> Result<(), GeometryError> {
        let Some(skin) = child(controller, "skin") else {
            return Ok(());
        };
        let part = self.xml.named(skin, "source")?;
        let node_from_part = match child(skin, "bind_shape_matrix") {
            Some(matrix) => Matrix4::from_row_slice(&self.xml.exactly::<16>(matrix)?),
            None => Matrix4::identity(),
        };
        self.place(part, &(scene_from_node * node_from_part))
    }

    /// The product of a node's transformations, in the order of the file.
    fn parent_from_node(&self, node: Node) -> Result<Matrix4<f64>, GeometryError> {
        let mut product = Matrix4::identity();
        for element in node.children().filter(Node::is_element) {
            product *= match element.tag_name().name() {
                "matrix" => Matrix4::from_row_slice(&self.xml.exactly::<16>(element)?),
                "translate" => Matrix4::new_translation(&Vector3::from(self.xml.exactly::<3>(element)?)),
                "scale" => Matrix4::new_nonuniform_scaling(&Vector3::from(self.xml.exactly::<3>(element)?)),
                "rotate" => {
                    let [x, y, z, degrees] = self.xml.exactly::<4>(element)?;
                    Unit::try_new(Vector3::new(x, y, z), 0.0).map_or_else(Matrix4::identity, |axis| {
                        Matrix4::from_axis_angle(&axis, degrees.to_radians())
                    })
                }
                name @ ("lookat" | "skew") => {
                    let expected = "matrix, translate, rotate or scale";
                    return Err(self.xml.error(element, quoted(name), expected));
                }
                _ => continue,
            };
        }
        Ok(product)
    }
}
