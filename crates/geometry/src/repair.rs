//! What can be mended in a mesh without guessing.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::TriMesh;
use crate::topology::{Edges, chains, components, is_collapsed, position_triangles, rim as open_rim};

/// A part counts as a body, with an inside and an outside, if its volume exceeds this share of area^{3/2}. For a ball
/// the share is 0.094, for a blade a hundred times as long and wide as thick 0.003.
const FULLNESS: f64 = 1e-3;

/// How many points of a part are asked whether it lies inside another.
const WITNESSES: usize = 15;

/// How many bodies, the largest first, may hold other parts: keeps files of a million loose pieces in linear time.
const MOST_BODIES: usize = 256;

/// What [`repair`] did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Repairs {
    /// Vertices that gave way to an earlier one at the same position.
    pub merged_vertices: usize,
    /// Vertices that no triangle uses, left out.
    pub unused_vertices: usize,
    /// Triangles with two corners at one position, left out.
    pub dropped_triangles: usize,
    /// Triangles turned round to agree with their neighbours.
    pub flipped_triangles: usize,
    /// Components that were inside out and were turned as a whole.
    pub inverted: usize,
}

/// Mends what is safe to mend, and counts it.
///
/// Vertices at equal positions become one. Triangles with two equal corners go; flat ones with three different corners
/// stay, since without them the surface would open. In each part that hangs together by edges of two triangles, the
/// minority that is wound against the rest is turned; then parts of negative volume are turned as a whole, holes being
/// thought closed by fans. A sheet that encloses next to nothing keeps its sense, and a part inside another one (a cavity,
/// or a body of its own) keeps its sense relative to the outer one. Holes and edges with more than two triangles stay as
/// they are. Where nothing but collapsed triangles is there, the mesh comes back unchanged.
#[expect(
    clippy::missing_panics_doc,
    reason = "what remains of a checked mesh is in range and finite"
)]
pub fn repair(mesh: TriMesh) -> (TriMesh, Repairs) {
    let merged = position_triangles(&mesh);
    let mut triangles: Vec<[u32; 3]> = merged.iter().copied().filter(|&t| !is_collapsed(t)).collect();
    if triangles.is_empty() {
        return (mesh, Repairs::default());
    }
    let dropped_triangles = merged.len() - triangles.len();
    let edges = Edges::new(&triangles);
    let flipped_triangles = make_consistent(&mut triangles, &edges);
    let inverted = turn_outward(mesh.vertices(), &mut triangles);

    let mut in_use = vec![None; mesh.vertices().len()];
    let mut vertices = Vec::new();
    for vertex in triangles.iter_mut().flatten() {
        let index = in_use[*vertex as usize].get_or_insert_with(|| {
            vertices.push(mesh.vertices()[*vertex as usize]);
            vertices.len() as u32 - 1
        });
        *vertex = *index;
    }
    let referenced = count_referenced(&mesh);
    let repairs = Repairs {
        merged_vertices: referenced - vertices.len(),
        unused_vertices: mesh.vertices().len() - referenced,
        dropped_triangles,
        flipped_triangles,
        inverted,
    };
    let repaired = TriMesh::new(vertices, triangles).expect("a part of a valid mesh is valid");
    (repaired, repairs)
}

/// Turns the smaller part of each manifold patch against which the larger one is wound; says how many.
fn make_consistent(triangles: &mut [[u32; 3]], edges: &Edges) -> usize {
    // A triangle has as many neighbours as edges, at most.
    let mut neighbours: Vec<[Option<(u32, bool)>; 3]> = vec![[None; 3]; triangles.len()];
    let mut join = |triangle: usize, neighbour: usize, agree: bool| {
        if let Some(place) = neighbours[triangle].iter_mut().find(|n| n.is_none()) {
            *place = Some((neighbour as u32, agree));
        }
    };
    for (_, sides) in edges.iter() {
        if let [one, other] = sides {
            let agree = one.upward != other.upward;
            join(one.triangle, other.triangle, agree);
            join(other.triangle, one.triangle, agree);
        }
    }
    let mut turned: Vec<Option<bool>> = vec![None; triangles.len()];
    let mut n_flipped = 0;
    for seed in 0..triangles.len() {
        if turned[seed].is_some() {
            continue;
        }
        turned[seed] = Some(false);
        let mut patch = vec![seed];
        let mut queue = VecDeque::from([(seed, false)]);
        while let Some((triangle, is_turned)) = queue.pop_front() {
            for (neighbour, agree) in neighbours[triangle].iter().flatten() {
                let (neighbour, agree) = (*neighbour as usize, *agree);
                if turned[neighbour].is_none() {
                    let turn = is_turned == agree;
                    turned[neighbour] = Some(turn);
                    patch.push(neighbour);
                    queue.push_back((neighbour, turn));
                }
            }
        }
        let n_turned = patch.iter().filter(|&&t| turned[t] == Some(true)).count();
        let minority = n_turned * 2 <= patch.len();
        for triangle in patch {
            if turned[triangle] == Some(minority) {
                triangles[triangle].swap(1, 2);
                n_flipped += 1;
            }
        }
    }
    n_flipped
}

/// Turns components that are inside out, with all that lies inside them; says how many were turned.
fn turn_outward(vertices: &[Point3<f64>], triangles: &mut [[u32; 3]]) -> usize {
    let edges = Edges::new(triangles);
    let members = components(triangles, &edges);
    let mut component_of = vec![0; triangles.len()];
    for (component, members) in members.iter().enumerate() {
        for &triangle in members {
            component_of[triangle] = component;
        }
    }
    let mut rims = vec![Vec::new(); members.len()];
    for (ends, sides) in edges.iter() {
        rims[component_of[sides[0].triangle]].extend(open_rim(ends, sides));
    }
    let parts: Vec<Part> = members
        .into_iter()
        .zip(rims)
        .map(|(members, rim)| Part::new(members, &rim, vertices, triangles))
        .collect();
    let mut bodies: Vec<&Part> = parts.iter().filter(|part| part.is_body()).collect();
    bodies.sort_by(|a, b| b.volume.abs().total_cmp(&a.volume.abs()));
    bodies.truncate(MOST_BODIES);
    if !parts.iter().any(Part::is_inside_out) {
        return 0;
    }
    let mut n_inverted = 0;
    for part in &parts {
        let mut larger = bodies
            .iter()
            .take_while(|body| body.volume.abs() > part.volume.abs());
        let outermost = larger.find(|body| body.holds(part)).map_or(part, |body| *body);
        if outermost.is_inside_out() {
            for &triangle in &part.members {
                triangles[triangle].swap(1, 2);
            }
            n_inverted += 1;
        }
    }
    n_inverted
}

/// A component, its holes closed by fans around their middle.
struct Part {
    members: Vec<usize>,
    corners: Vec<[Point3<f64>; 3]>,
    low: Point3<f64>,
    high: Point3<f64>,
    volume: f64,
    area: f64,
}

impl Part {
    fn new(members: Vec<usize>, rim: &[[u32; 2]], vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let mut corners: Vec<_> = members
            .iter()
            .map(|&t| triangles[t].map(|v| vertices[v as usize]))
            .collect();
        let first = corners[0][0];
        let (mut low, mut high) = (first, first);
        for point in corners.iter().flatten() {
            low = low.inf(point);
            high = high.sup(point);
        }
        let area = corners
            .iter()
            .map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0)
            .sum();
        for hole in chains(rim) {
            let ends = hole.iter().map(|edge| edge.map(|v| vertices[v as usize]));
            let sum: Vector3<f64> = ends.clone().map(|[from, _]| from - first).sum();
            let middle = first + sum / hole.len() as f64;
            corners.extend(ends.map(|[from, to]| [to, from, middle]));
        }
        let volume = corners
            .iter()
            .map(|[a, b, c]| (a - first).dot(&(b - first).cross(&(c - first))) / 6.0)
            .sum();
        Self {
            members,
            corners,
            low,
            high,
            volume,
            area,
        }
    }

    fn is_body(&self) -> bool {
        self.volume.abs() > FULLNESS * self.area.powf(1.5)
    }

    fn is_inside_out(&self) -> bool {
        self.is_body() && self.volume < 0.0
    }

    /// Whether a part lies inside this one, judged by the middles of some of its triangles.
    fn holds(&self, part: &Self) -> bool {
        let within = |k| self.low[k] <= part.low[k] && part.high[k] <= self.high[k];
        if !(0..3).all(within) {
            return false;
        }
        let step = part.members.len().div_ceil(WITNESSES);
        let witnesses: Vec<Point3<f64>> = part.corners[..part.members.len()]
            .iter()
            .step_by(step)
            .map(|[a, b, c]| a + ((b - a) + (c - a)) / 3.0)
            .collect();
        let n_inside = witnesses
            .iter()
            .filter(|point| self.winding_number(point).abs() > 0.5)
            .count();
        n_inside * 2 > witnesses.len()
    }

    /// How often the surface goes round a point: the sum of the triangles' solid angles over 4π.
    fn winding_number(&self, point: &Point3<f64>) -> f64 {
        let angles = self.corners.iter().map(|corners| {
            let [a, b, c] = corners.map(|p| p - point);
            let [la, lb, lc] = [a.norm(), b.norm(), c.norm()];
            let numerator = a.dot(&b.cross(&c));
            let denominator = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
            2.0 * numerator.atan2(denominator)
        });
        angles.sum::<f64>() / (4.0 * std::f64::consts::PI)
    }
}

fn count_referenced(mesh: &TriMesh) -> usize {
    let mut referenced = vec![false; mesh.vertices().len()];
    mesh.triangles()
        .iter()
        .flatten()
        .for_each(|&v| referenced[v as usize] = true);
    referenced.into_iter().filter(|&r| r).count()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::{OrientedBox, inspect, signed_volume};

    /// A cube about the origin, closed and outward; faces in pairs of triangles, −x +x −y +y −z +z.
    pub(crate) fn cube(edge: f64) -> TriMesh {
        OrientedBox::centered([edge; 3]).surface()
    }

    fn turned(mesh: &TriMesh) -> TriMesh {
        let triangles = mesh.triangles().iter().map(|&[a, b, c]| [a, c, b]).collect();
        TriMesh::new(mesh.vertices().to_vec(), triangles).unwrap()
    }

    fn joined(meshes: &[TriMesh]) -> TriMesh {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for mesh in meshes {
            let offset = vertices.len() as u32;
            vertices.extend_from_slice(mesh.vertices());
            triangles.extend(mesh.triangles().iter().map(|t| t.map(|v| v + offset)));
        }
        TriMesh::new(vertices, triangles).unwrap()
    }

    #[test]
    fn a_sound_mesh_stays_as_it_is() {
        let (repaired, repairs) = repair(cube(1.0));
        assert_eq!(repairs, Repairs::default());
        assert!((signed_volume(&repaired) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_soup_becomes_one_surface() {
        let corners: Vec<_> = cube(1.0).corners().flatten().collect();
        let mut triangles: Vec<[u32; 3]> = (0..12).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        triangles.push([0, 0, 5]);
        let (repaired, repairs) = repair(TriMesh::new(corners, triangles).unwrap());
        assert_eq!(repaired.vertices().len(), 8);
        assert_eq!((repairs.merged_vertices, repairs.dropped_triangles), (28, 1));
    }

    #[test]
    fn the_minority_is_turned_to_agree() {
        let cube = cube(1.0);
        for turned in [vec![3_usize], vec![0, 5, 7], vec![1, 2, 4, 11]] {
            let mut triangles = cube.triangles().to_vec();
            for &triangle in &turned {
                triangles[triangle].swap(0, 1);
            }
            let (repaired, repairs) = repair(TriMesh::new(cube.vertices().to_vec(), triangles).unwrap());
            assert_eq!((repairs.flipped_triangles, repairs.inverted), (turned.len(), 0));
            assert_eq!(inspect(&repaired).inconsistent_edges, 0);
            assert!((signed_volume(&repaired) - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn a_closed_part_that_is_inside_out_is_turned() {
        let (repaired, repairs) = repair(turned(&cube(2.0)));
        assert_eq!((repairs.flipped_triangles, repairs.inverted), (0, 1));
        assert!((signed_volume(&repaired) - 8.0).abs() < 1e-14);
    }

    #[test]
    fn a_cavity_stays_a_cavity() {
        let hollow = joined(&[cube(2.0), turned(&cube(1.0))]);
        assert_eq!(repair(hollow.clone()).1, Repairs::default());
        let (repaired, repairs) = repair(turned(&hollow));
        assert_eq!(repairs.inverted, 2);
        assert!((signed_volume(&repaired) - 7.0).abs() < 1e-14);
    }

    #[test]
    fn an_open_vessel_is_turned_and_a_sheet_is_not() {
        let cube = turned(&cube(1.0));
        let open = |n: usize| TriMesh::new(cube.vertices().to_vec(), cube.triangles()[n..].to_vec()).unwrap();
        assert_eq!(repair(open(2)).1.inverted, 1);
        assert_eq!(repair(open(10)).1.inverted, 0);
    }

    #[test]
    fn bodies_that_share_an_edge_are_turned_together() {
        let low = cube(1.0);
        let high = low.transformed(&nalgebra::Isometry3::translation(1.0, 0.0, 1.0));
        let (repaired, repairs) = repair(turned(&joined(&[low, high])));
        assert_eq!((repairs.inverted, repairs.flipped_triangles), (1, 0));
        assert_eq!(inspect(&repaired).non_manifold_edges, 1);
        assert!((signed_volume(&repaired) - 2.0).abs() < 1e-14);
    }

    #[test]
    fn thousands_of_loose_parts_take_no_time() {
        let cube = turned(&cube(1.0));
        let at = |i: i32| {
            nalgebra::Isometry3::translation(f64::from(i % 100) * 2.0, f64::from(i / 100) * 2.0, 0.0)
        };
        let many: Vec<_> = (0..5000).map(|i| cube.transformed(&at(i))).collect();
        let (repaired, repairs) = repair(joined(&many));
        assert_eq!((repairs.inverted, repairs.flipped_triangles), (5000, 0));
        assert!((signed_volume(&repaired) - 5000.0).abs() < 1e-7);
    }

    #[test]
    fn nothing_but_collapsed_triangles_comes_back_unchanged() {
        let flat = TriMesh::new(vec![Point3::origin(); 3], vec![[0, 1, 2]]).unwrap();
        assert_eq!(repair(flat.clone()), (flat, Repairs::default()));
    }
}
