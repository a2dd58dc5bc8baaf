//! The solids of a link, from its `<collision>` and `<visual>` elements.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};
use prehend_geometry::{
    GeometryError, MeshFormat, PlacedSolid, Shape, Solid, TriMesh, convex_hull, inspect, read_shape_with,
    repair, signed_volume,
};

use crate::urdf::pose;
use crate::xml::{Geometry, RawLink};
use crate::{HandError, Link};

/// Takes a mesh file's name, as the URDF gives it, to its bytes, or says why it cannot.
pub type Resolve<'a> = dyn Fn(&str) -> Result<Vec<u8>, String> + 'a;

pub(crate) struct ShapeReader<'a> {
    resolve: &'a Resolve<'a>,
    /// What has been read: hands use the same file for several links.
    meshes: BTreeMap<(String, [u64; 3], Use), Vec<Solid>>,
    warnings: Vec<String>,
}

impl<'a> ShapeReader<'a> {
    pub fn new(resolve: &'a Resolve<'a>) -> Self {
        Self {
            resolve,
            meshes: BTreeMap::new(),
            warnings: Vec::new(),
        }
    }

    pub fn into_warnings(self) -> Vec<String> {
        self.warnings
    }

    pub fn read_link(&mut self, raw: &RawLink) -> Result<Link, HandError> {
        let place = || format!("link `{}`", raw.name);
        let mut collision = Vec::with_capacity(raw.collision.len());
        for element in &raw.collision {
            let link_from_solid = pose(&element.origin, place)?;
            let solids = self.read_solids(&raw.name, &element.geometry, Use::Collision)?;
            collision.extend(placed(solids, link_from_solid));
        }
        let collision = merge_capsules(collision);
        let mut visual = Vec::with_capacity(raw.visual.len());
        for element in &raw.visual {
            let link_from_solid = pose(&element.origin, place)?;
            match self.read_solids(&raw.name, &element.geometry, Use::Visual) {
                Ok(solids) => visual.extend(placed(solids, link_from_solid)),
                Err(error @ (HandError::MeshMissing { .. } | HandError::MeshUnreadable { .. })) => {
                    self.warnings.push(format!("not drawn: {error}"));
                }
                Err(error) => return Err(error),
            }
        }
        Ok(Link {
            name: raw.name.clone(),
            collision,
            visual,
            mass: mass(raw)?,
        })
    }

    /// The solids of one element: a mesh for collisions may be several convex ones.
    fn read_solids(
        &mut self,
        link: &str,
        geometry: &Geometry,
        purpose: Use,
    ) -> Result<Vec<Solid>, HandError> {
        let size = |what, numbers: &[f64]| positive(link, what, numbers);
        let solid = match geometry {
            Geometry::Box { size: lengths } => {
                size("box size", lengths)?;
                Solid::Cuboid {
                    half_extents: Vector3::from(*lengths) / 2.0,
                }
            }
            Geometry::Cylinder { radius, length } => {
                size("cylinder radius and length", &[*radius, *length])?;
                Solid::Cylinder {
                    half_length: length / 2.0,
                    radius: *radius,
                }
            }
            // As in SDF and MuJoCo, the length is that of the cylinder between the caps.
            Geometry::Capsule { radius, length } => {
                size("capsule radius and length", &[*radius, *length])?;
                Solid::Capsule {
                    half_length: length / 2.0,
                    radius: *radius,
                }
            }
            Geometry::Sphere { radius } => {
                size("sphere radius", &[*radius])?;
                Solid::Sphere { radius: *radius }
            }
            Geometry::Mesh { filename, scale } => {
                let scale = Vector3::from(*scale);
                let key = (filename.clone(), scale.map(f64::to_bits).into(), purpose);
                if let Some(solids) = self.meshes.get(&key) {
                    return Ok(solids.clone());
                }
                let mesh = self.read_mesh(link, filename, &scale)?;
                let solids = match purpose {
                    Use::Collision => collision_solids(mesh),
                    Use::Visual => vec![Solid::Mesh(Arc::new(mesh))],
                };
                self.meshes.insert(key, solids.clone());
                return Ok(solids);
            }
        };
        Ok(vec![solid])
    }

    fn read_mesh(&mut self, link: &str, file: &str, scale: &Vector3<f64>) -> Result<TriMesh, HandError> {
        if scale.iter().any(|s| !s.is_finite() || *s == 0.0) {
            return Err(HandError::Value {
                place: format!("link `{link}`, mesh `{file}`"),
                what: "scale",
                found: format!("{:?}", scale.as_slice()),
                expected: "three finite numbers, none of them 0",
            });
        }
        let unreadable = |reason: String| HandError::MeshUnreadable {
            link: link.to_owned(),
            file: file.to_owned(),
            reason,
        };
        let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
        let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
        let Some(format) = MeshFormat::from_extension(extension) else {
            let known = MeshFormat::EXTENSIONS.join(", ");
            return Err(unreadable(format!(
                "`.{extension}` is not a format that is read; use one of {known}"
            )));
        };
        let bytes = (self.resolve)(file).map_err(|reason| HandError::MeshMissing {
            link: link.to_owned(),
            file: file.to_owned(),
            reason,
        })?;
        // Further files (a glTF's buffers) stand beside the mesh.
        let folder = &file[..file.len() - name.len()];
        let beside = |further: &str| {
            (self.resolve)(&format!("{folder}{further}")).map_err(|reason| format!("cannot be had: {reason}"))
        };
        let read = read_shape_with(&bytes, format, &beside).map_err(|error| unreadable(error.to_string()))?;
        let Shape::Mesh(mesh) = read.shape else {
            return Err(unreadable("it is a cloud of points without triangles".to_owned()));
        };
        // As ROS does: a COLLADA file's unit counts, its upward axis does not.
        let scale = scale * read.stated.metres_per_unit.unwrap_or(1.0);
        scaled(&mesh, &scale).map_err(|error| unreadable(error.to_string()))
    }
}

fn placed(solids: Vec<Solid>, link_from_solid: Isometry3<f64>) -> impl Iterator<Item = PlacedSolid> {
    solids.into_iter().map(move |solid| PlacedSolid {
        solid,
        link_from_solid,
    })
}

/// What a solid is read for.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Use {
    Collision,
    Visual,
}

/// Share of its convex hull's volume that a mesh may leave out and still count as that hull: dents of a thousandth
/// are finer than the collision meshes that come with hands.
const HULL_DEFICIT: f64 = 1e-3;

/// A mesh as solids that collide: its convex hull where it fills that; the hulls of its parts where each part that
/// hangs together fills its own (files of convex pieces are made so); else its surface.
fn collision_solids(mesh: TriMesh) -> Vec<Solid> {
    // In a file of pieces these do not share corners, though they may touch: parted before equal corners are merged.
    let parts = parts(&mesh);
    let (whole, _) = repair(mesh);
    if let Some(hull) = filled_hull(&whole) {
        return vec![hull];
    }
    if (2..=MOST_PARTS).contains(&parts.len()) {
        let hulls: Option<Vec<Solid>> = parts
            .into_iter()
            .map(|part| filled_hull(&repair(part).0))
            .collect();
        if let Some(hulls) = hulls {
            return hulls;
        }
    }
    vec![Solid::Mesh(Arc::new(whole))]
}

/// More parts than this are no pieces of a link but triangles of a surface without shared corners.
const MOST_PARTS: usize = 256;

/// The convex hull of a mesh that fills it.
fn filled_hull(mesh: &TriMesh) -> Option<Solid> {
    if !inspect(mesh).watertight {
        return None;
    }
    let hull = convex_hull(mesh.vertices()).ok()?;
    if hull.volume() <= 0.0 || signed_volume(mesh) < (1.0 - HULL_DEFICIT) * hull.volume() {
        return None;
    }
    let corners: BTreeSet<u32> = hull.triangles().iter().flatten().copied().collect();
    let points = corners
        .iter()
        .map(|&corner| hull.points()[corner as usize])
        .collect();
    Some(Solid::Hull(Arc::new(points)))
}

/// The parts of a mesh whose triangles share corners, in the order of their first triangles.
fn parts(mesh: &TriMesh) -> Vec<TriMesh> {
    // A forest over corners: each points to one of its part nearer the root.
    let mut up: Vec<u32> = (0..mesh.vertices().len() as u32).collect();
    let root = |up: &mut Vec<u32>, mut at: u32| {
        while up[at as usize] != at {
            up[at as usize] = up[up[at as usize] as usize];
            at = up[at as usize];
        }
        at
    };
    for &[a, b, c] in mesh.triangles() {
        let a = root(&mut up, a);
        for other in [b, c] {
            let other = root(&mut up, other);
            up[other as usize] = a;
        }
    }
    let mut part_of: BTreeMap<u32, usize> = BTreeMap::new();
    let mut triangles: Vec<Vec<[u32; 3]>> = Vec::new();
    for &triangle in mesh.triangles() {
        let n = part_of.len();
        let part = *part_of.entry(root(&mut up, triangle[0])).or_insert(n);
        if part == triangles.len() {
            triangles.push(Vec::new());
        }
        triangles[part].push(triangle);
    }
    if triangles.len() > MOST_PARTS {
        return Vec::new();
    }
    triangles
        .into_iter()
        .filter_map(|triangles| {
            let used: BTreeSet<u32> = triangles.iter().flatten().copied().collect();
            let place: BTreeMap<u32, u32> = used.iter().zip(0..).map(|(&old, new)| (old, new)).collect();
            let vertices = used.iter().map(|&v| mesh.vertices()[v as usize]).collect();
            let triangles = triangles.iter().map(|t| t.map(|v| place[&v])).collect();
            TriMesh::new(vertices, triangles).ok()
        })
        .collect()
}

/// The mesh scaled along each axis; mirrored, it is wound the other way round, so that it still looks outwards.
fn scaled(mesh: &TriMesh, scale: &Vector3<f64>) -> Result<TriMesh, GeometryError> {
    let vertices = mesh
        .vertices()
        .iter()
        .map(|p| p.coords.component_mul(scale).into())
        .collect();
    let mut triangles = mesh.triangles().to_vec();
    if scale.product() < 0.0 {
        for triangle in &mut triangles {
            triangle.swap(1, 2);
        }
    }
    TriMesh::new(vertices, triangles)
}

/// Turns every cylinder with a ball of its radius about each end into a capsule: plain URDF has no word for one.
fn merge_capsules(solids: Vec<PlacedSolid>) -> Vec<PlacedSolid> {
    let mut kept = solids;
    let mut at = 0;
    while at < kept.len() {
        if let Solid::Cylinder { half_length, radius } = kept[at].solid {
            let close = 1e-4 * radius;
            let ball_at = |z: f64| {
                let end = kept[at].link_from_solid * Point3::new(0.0, 0.0, z);
                kept.iter().position(|other| match other.solid {
                    Solid::Sphere { radius: r } => {
                        let center = Point3::from(other.link_from_solid.translation.vector);
                        (r - radius).abs() <= close && (center - end).norm() <= close
                    }
                    _ => false,
                })
            };
            if let (Some(a), Some(b)) = (ball_at(-half_length), ball_at(half_length)) {
                kept[at].solid = Solid::Capsule { half_length, radius };
                let cylinder = at;
                let mut idx = 0;
                kept.retain(|_| {
                    idx += 1;
                    idx - 1 != a && idx - 1 != b
                });
                at = cylinder - usize::from(a < cylinder) - usize::from(b < cylinder);
            }
        }
        at += 1;
    }
    kept
}

fn positive(link: &str, what: &'static str, numbers: &[f64]) -> Result<(), HandError> {
    if numbers.iter().all(|n| n.is_finite() && *n > 0.0) {
        return Ok(());
    }
    Err(HandError::Value {
        place: format!("link `{link}`"),
        what,
        found: format!("{numbers:?}"),
        expected: "positive, finite lengths in metres",
    })
}

/// The mass, kg; 0 stands for none.
fn mass(raw: &RawLink) -> Result<Option<f64>, HandError> {
    let mass = raw.mass.unwrap_or(0.0);
    if mass == 0.0 {
        return Ok(None);
    }
    if mass.is_finite() && mass > 0.0 {
        return Ok(Some(mass));
    }
    Err(HandError::Value {
        place: format!("link `{}`", raw.name),
        what: "mass",
        found: mass.to_string(),
        expected: "a positive number of kilograms",
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Hand;

    /// The collision solids of one link that holds `elements`, where every mesh file is `mesh`.
    fn solids(elements: &str, mesh: &str) -> Vec<PlacedSolid> {
        let urdf = format!("<robot name=\"r\"><link name=\"l\">{elements}</link></robot>");
        let hand = Hand::from_urdf(&urdf, &|_| Ok(mesh.as_bytes().to_vec())).expect("the URDF is right");
        hand.links()[0].collision.clone()
    }

    fn placed(xyz: &str, geometry: &str) -> String {
        format!("<collision><origin xyz=\"{xyz}\"/><geometry>{geometry}</geometry></collision>")
    }

    #[test]
    fn a_cylinder_between_two_balls_is_a_capsule() {
        let cylinder = placed("0 0 1", r#"<cylinder radius="0.01" length="0.04"/>"#);
        let ball = |z: &str| placed(&format!("0 0 {z}"), r#"<sphere radius="0.01"/>"#);
        let capsule = Solid::Capsule {
            half_length: 0.02,
            radius: 0.01,
        };
        for elements in [
            cylinder.clone() + &ball("0.98") + &ball("1.02"),
            ball("0.98") + &cylinder + &ball("1.02"),
            ball("0.98") + &ball("1.02") + &cylinder,
        ] {
            let solids = solids(&elements, "");
            assert_eq!(solids.len(), 1);
            assert_eq!(solids[0].solid, capsule);
            assert_eq!(solids[0].link_from_solid.translation.z, 1.0);
        }
        let one_ball = solids(&(ball("0.5") + &cylinder + &ball("1.02")), "");
        assert_eq!(one_ball.len(), 3, "a ball that stands elsewhere is a ball");
        assert!(matches!(one_ball[1].solid, Solid::Cylinder { .. }));
    }

    /// A chain of three balls and two cylinders: each ball between cylinders can serve only one of them.
    #[test]
    fn balls_that_two_cylinders_share_are_kept_for_one() {
        let cylinder = |z: &str| placed(&format!("0 0 {z}"), r#"<cylinder radius="0.01" length="0.04"/>"#);
        let ball = |z: &str| placed(&format!("0 0 {z}"), r#"<sphere radius="0.01"/>"#);
        let chain = ball("0") + &cylinder("0.02") + &ball("0.04") + &cylinder("0.06") + &ball("0.08");
        let solids = solids(&chain, "");
        let kinds: Vec<bool> = solids
            .iter()
            .map(|s| matches!(s.solid, Solid::Capsule { .. }))
            .collect();
        assert_eq!(kinds, [true, false, false], "capsule, cylinder, ball");
    }

    const TETRAHEDRON: &str = "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

    #[test]
    fn a_collada_unit_counts_its_upward_axis_does_not_and_buffers_stand_beside() {
        let link = "<collision><geometry><mesh filename=\"package://r/meshes/tip.EXT\" scale=\"2 2 2\"/></geometry></collision>";
        let urdf = |extension| {
            format!(
                "<robot name=\"r\"><link name=\"l\">{}</link></robot>",
                link.replace("EXT", extension)
            )
        };
        let collada = r##"<COLLADA><asset><unit meter="0.01"/><up_axis>Y_UP</up_axis></asset>
            <library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a">0 0 0 1 0 0 0 1 0 0 0 1</float_array>
            <technique_common><accessor source="#a" count="4" stride="3"/></technique_common></source>
            <triangles><input semantic="POSITION" source="#p"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry>
            </library_geometries></COLLADA>"##;
        let gltf = r#"{"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"uri": "tip.bin", "byteLength": 36}]}"#;
        let buffer: Vec<u8> = [0_f32, 0., 0., 0., 0., 0.01, 0., 0.01, 0.]
            .map(f32::to_le_bytes)
            .concat();
        let resolve = |name: &str| match name {
            "package://r/meshes/tip.dae" => Ok(collada.as_bytes().to_vec()),
            "package://r/meshes/tip.gltf" => Ok(gltf.as_bytes().to_vec()),
            "package://r/meshes/tip.bin" => Ok(buffer.clone()),
            _ => Err(format!("{name} is missing")),
        };
        for extension in ["dae", "gltf"] {
            let hand = Hand::from_urdf(&urdf(extension), &resolve).unwrap();
            let points = match &hand.links()[0].collision[0].solid {
                Solid::Hull(points) => points.to_vec(),
                Solid::Mesh(mesh) => mesh.vertices().to_vec(),
                other => panic!("{other:?}"),
            };
            let highest = points.iter().map(|p| p.z).fold(0.0, f64::max);
            assert!((highest - 0.02).abs() < 1e-9, "{extension}: {highest}");
        }
    }

    #[test]
    fn a_convex_mesh_becomes_its_hull_and_a_mirrored_one_too() {
        for (scale, corner) in [
            ("2 1 1", Point3::new(2.0, 0.0, 0.0)),
            ("-2 1 1", Point3::new(-2.0, 0.0, 0.0)),
        ] {
            let mesh = format!("<mesh filename=\"tip.off\" scale=\"{scale}\"/>");
            let solids = solids(&placed("0 0 0", &mesh), TETRAHEDRON);
            let Solid::Hull(points) = &solids[0].solid else {
                panic!("{:?}", solids[0].solid)
            };
            assert_eq!(points.len(), 4);
            assert!(points.contains(&corner), "{points:?}");
        }
    }

    #[test]
    fn a_mesh_with_a_dent_or_a_hole_stays_a_mesh() {
        let open = TETRAHEDRON.replace("4 4 0", "4 3 0").replace("3 1 2 3\n", "");
        // A fourth face pushed inwards at its middle.
        let five = "OFF\n5 6 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0.2 0.2 0.2\n\
                    3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 4\n3 2 3 4\n3 3 1 4\n";
        for text in [open.as_str(), five] {
            let solids = solids(&placed("0 0 0", r#"<mesh filename="a.off"/>"#), text);
            assert!(matches!(solids[0].solid, Solid::Mesh(_)), "{:?}", solids[0].solid);
        }
    }

    #[test]
    fn boxes_and_cylinders_are_given_by_full_lengths() {
        let solids = solids(
            &(placed("0 0 0", r#"<box size="2 4 6"/>"#)
                + &placed("0 0 0", r#"<capsule radius="1" length="6"/>"#)),
            "",
        );
        assert_eq!(
            solids[0].solid,
            Solid::Cuboid {
                half_extents: Vector3::new(1.0, 2.0, 3.0)
            }
        );
        assert_eq!(
            solids[1].solid,
            Solid::Capsule {
                half_length: 3.0,
                radius: 1.0
            }
        );
    }
}
