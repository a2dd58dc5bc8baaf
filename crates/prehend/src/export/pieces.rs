//! An object as convex pieces, for simulators that take the hull of each mesh.

use nalgebra::{Point3, Vector3};
use prehend_geometry::{ConvexHull, TriMesh, convex_hull, enclosed_volume};

/// Most pieces of one object.
const MOST_PIECES: usize = 48;
/// Enough where the pieces' volume is within this share of the object's.
const CLOSE_ENOUGH: f64 = 0.03;
/// Places along each axis where a cut is tried, and the least share of the whole that a cut must save.
const PLACES: usize = 7;
const WORTH: f64 = 1e-4;

/// Convex pieces of an object.
#[derive(Debug, Clone)]
pub struct Pieces {
    /// Corners and volume (m³) of each piece; pieces do not overlap.
    pub pieces: Vec<(Vec<Point3<f64>>, f64)>,
    /// How much more volume they have than the object, as a share of the object's.
    pub volume_deviation: f64,
}

/// Cuts a surface with planes along the axes, where that saves most of the volume that the hulls of the parts have too
/// much, until they have hardly any too much or there are 48 of them.
///
/// A piece is the hull of the part of the surface on its side of the cuts, so a thin wall comes out as thick as it is,
/// and where it curves, as thick as its curve within a piece is deep.
pub fn convex_pieces(mesh: &TriMesh) -> Pieces {
    let triangles: Vec<[Point3<f64>; 3]> = mesh.corners().collect();
    let volume = enclosed_volume(mesh).volume.abs();
    let mut parts: Vec<Part> = Part::new(triangles).into_iter().collect();
    let mut cuts: Vec<Option<Cut>> = parts.iter().map(Part::best_cut).collect();
    while parts.len() < MOST_PIECES {
        let total: f64 = parts.iter().map(|p| p.hull.volume()).sum();
        if total <= volume * (1.0 + CLOSE_ENOUGH) {
            break;
        }
        let saved = |cut: &Option<Cut>| cut.as_ref().map_or(0.0, |c| c.saved);
        let Some(most) =
            (0..parts.len()).max_by(|&a, &b| saved(&cuts[a]).total_cmp(&saved(&cuts[b])).then(b.cmp(&a)))
        else {
            break;
        };
        match cuts[most].take() {
            Some(cut) if cut.saved > WORTH * total => {
                let [first, second] = cut.parts;
                cuts[most] = first.best_cut();
                cuts.push(second.best_cut());
                parts[most] = first;
                parts.push(second);
            }
            _ => break,
        }
    }
    let total: f64 = parts.iter().map(|p| p.hull.volume()).sum();
    Pieces {
        volume_deviation: if volume > 0.0 { total / volume - 1.0 } else { 0.0 },
        pieces: parts
            .into_iter()
            .map(|part| (corners(&part.hull), part.hull.volume()))
            .collect(),
    }
}

/// Corners that the hull needs, in order of their index.
pub(super) fn corners(hull: &ConvexHull) -> Vec<Point3<f64>> {
    let used: std::collections::BTreeSet<u32> = hull.triangles().iter().flatten().copied().collect();
    used.iter().map(|&i| hull.points()[i as usize]).collect()
}

/// A part of the surface and its hull.
struct Part {
    triangles: Vec<[Point3<f64>; 3]>,
    hull: ConvexHull,
}

/// A way to cut a part in two.
struct Cut {
    saved: f64,
    parts: [Part; 2],
}

impl Part {
    /// `None` where the hull would be flat.
    fn new(triangles: Vec<[Point3<f64>; 3]>) -> Option<Self> {
        let points: Vec<Point3<f64>> = triangles.iter().flatten().copied().collect();
        let hull = convex_hull(&points).ok().filter(|h| h.volume() > 0.0)?;
        Some(Self { triangles, hull })
    }

    fn best_cut(&self) -> Option<Cut> {
        let mut best: Option<Cut> = None;
        for axis in 0..3 {
            let along = self.hull.points().iter().map(|p| p[axis]);
            let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
                (l.min(x), h.max(x))
            });
            for place in 1..=PLACES {
                let at = low + (high - low) * place as f64 / (PLACES + 1) as f64;
                let mut sides = [Vec::new(), Vec::new()];
                for triangle in &self.triangles {
                    cut_triangle(triangle, axis, at, &mut sides);
                }
                let [below, above] = sides.map(Part::new);
                let (Some(below), Some(above)) = (below, above) else {
                    continue;
                };
                let saved = self.hull.volume() - below.hull.volume() - above.hull.volume();
                if best.as_ref().is_none_or(|b| saved > b.saved) {
                    best = Some(Cut {
                        saved,
                        parts: [below, above],
                    });
                }
            }
        }
        best
    }
}

/// Puts a triangle's parts below and above a plane on their sides.
fn cut_triangle(triangle: &[Point3<f64>; 3], axis: usize, at: f64, sides: &mut [Vec<[Point3<f64>; 3]>; 2]) {
    for (side, sign) in [(0, 1.0), (1, -1.0)] {
        let inside = |p: &Point3<f64>| sign * (at - p[axis]) >= 0.0;
        let mut polygon: Vec<Point3<f64>> = Vec::with_capacity(4);
        for k in 0..3 {
            let (p, q) = (triangle[k], triangle[(k + 1) % 3]);
            if inside(&p) {
                polygon.push(p);
            }
            if inside(&p) != inside(&q) {
                let share = (at - p[axis]) / (q[axis] - p[axis]);
                let mut cut: Vector3<f64> = p.coords + (q - p) * share;
                cut[axis] = at;
                polygon.push(cut.into());
            }
        }
        for k in 2..polygon.len() {
            sides[side].push([polygon[0], polygon[k - 1], polygon[k]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use prehend_geometry::Solid;

    #[test]
    fn a_box_is_one_piece_and_two_boxes_are_two() {
        let cube = |x: f64| {
            Solid::Cuboid {
                half_extents: Vector3::repeat(0.5),
            }
            .display_mesh()
            .transformed(&nalgebra::Isometry3::translation(x, 0.0, 0.0))
        };
        let one = convex_pieces(&cube(0.0));
        assert_eq!(one.pieces.len(), 1);
        assert!(one.volume_deviation.abs() < 1e-9);
        let (a, b) = (cube(0.0), cube(3.0));
        let mut vertices = a.vertices().to_vec();
        vertices.extend(b.vertices());
        let n = a.vertices().len() as u32;
        let mut triangles = a.triangles().to_vec();
        triangles.extend(b.triangles().iter().map(|t| t.map(|i| i + n)));
        let both = convex_pieces(&TriMesh::new(vertices, triangles).unwrap());
        assert_eq!(both.pieces.len(), 2);
        assert!(both.volume_deviation.abs() < 1e-9, "{}", both.volume_deviation);
    }
}
