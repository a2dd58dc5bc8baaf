//! An object as convex pieces, for simulators that take the hull of each mesh.

use nalgebra::{Point3, Vector3};
use prehend_geometry::{ConvexHull, Surface, TriMesh, enclosed_volume};
use rayon::prelude::*;

use super::part::{Part, Plane};

/// Most pieces of one object.
const MOST_PIECES: usize = 96;
/// Enough where the pieces' volume is within this share of the object's.
const CLOSE_ENOUGH: f64 = 0.05;
/// The least share of the whole that each further piece must save.
const WORTH: f64 = 1e-4;
/// Places along a direction where a cut is tried, besides flat faces.
const PLACES: usize = 9;
/// Flat faces along a direction beside which a cut is tried: a little above and below them.
const LEVELS: usize = 4;
const BESIDE: f64 = 0.004;
/// Numbers of wedges that are tried.
const WEDGES: [usize; 5] = [2, 3, 4, 6, 8];
/// Parts with at least this share of the whole hull are also cut in two of which one comes in so many wedges.
const LARGE: f64 = 0.2;
const WEDGES_BESIDE: [usize; 2] = [4, 8];
/// Directions closer than this (cosine) are the same.
const SAME_DIRECTION: f64 = 0.985;
/// Pieces reach out of the object by no more than this (m), if that can be had with as many pieces as are allowed.
const NEAR_ENOUGH: f64 = 1.5e-3;
/// Distance between the points (m) at which the pieces are compared with the surface, and the most along an edge.
const SAMPLES: f64 = 1.5e-3;
const MOST_SAMPLES: f64 = 40.0;

/// Convex pieces of an object.
#[derive(Debug, Clone)]
pub struct Pieces {
    /// Corners and volume (m³) of each piece; pieces do not overlap.
    pub pieces: Vec<(Vec<Point3<f64>>, f64)>,
    /// How much more volume they have than the object, as a share of the object's.
    pub volume_deviation: f64,
    /// How far the pieces' faces get from the object's surface outside of it, metres: the largest distance of points on
    /// them, at most 1.5 mm apart. The object reaches nowhere out of the pieces.
    pub surface_deviation: f64,
}

/// Cuts a surface into parts of which the hulls have little more volume than the object, at most 5 %, and reach out of it
/// by no more than 1.5 mm, unless 96 pieces are not enough for that.
///
/// A piece is the hull of the part of the object on its side of the cuts, so a thin wall comes out as thick as it is,
/// and where it curves, thicker by the depth of the curve within a piece. Where parts of a mesh overlap, the volume that
/// it encloses counts twice, and the pieces' does not. Every cut is the one that saves most volume of
/// hulls for each further piece, of these: planes across the axes of the object and of the part, at even places
/// and beside flat faces; wedges about the line that the part curves around, 2 to 8 of them; and for large parts both at
/// once, because what a plane beside the floor of a mug is good for shows only when the wall above comes in wedges.
pub fn convex_pieces(mesh: &TriMesh) -> Pieces {
    let volume = enclosed_volume(mesh).volume.abs();
    let surface = Surface::new(mesh.clone());
    let mut parts: Vec<Part> = Part::of(mesh).into_iter().collect();
    let whole: f64 = parts.iter().map(|p| p.hull_volume).sum();
    let mut cuts: Vec<Option<Cut>> = parts.iter().map(|p| best_cut(p, whole, &surface)).collect();
    while parts.len() < MOST_PIECES {
        let total: f64 = parts.iter().map(|p| p.hull_volume).sum();
        if total <= volume * (1.0 + CLOSE_ENOUGH) {
            break;
        }
        let Some(most) = highest(&cuts, |cut| cut.as_ref().map_or(0.0, |c| c.worth)) else {
            break;
        };
        match cuts[most].take() {
            Some(cut) if cut.worth > WORTH * total => {
                replace(&mut parts, &mut cuts, most, cut, whole, &surface);
            }
            _ => break,
        }
    }
    let mut farthest = deviations(&parts, &surface);
    while parts.len() < MOST_PIECES {
        let cut = highest(&farthest, |d| *d).filter(|most| farthest[*most] > NEAR_ENOUGH);
        let Some((most, cut)) = cut.and_then(|most| Some((most, cuts[most].take()?))) else {
            break;
        };
        let of_cut = deviations(&cut.parts, &surface);
        replace(&mut parts, &mut cuts, most, cut, whole, &surface);
        farthest[most] = of_cut[0];
        farthest.extend(&of_cut[1..]);
    }
    let total: f64 = parts.iter().map(|p| p.hull_volume).sum();
    Pieces {
        volume_deviation: if volume > 0.0 { total / volume - 1.0 } else { 0.0 },
        surface_deviation: farthest.into_iter().fold(0.0, f64::max),
        pieces: parts
            .iter()
            .filter_map(|part| Some((corners(&part.hull()?), part.hull_volume)))
            .collect(),
    }
}

/// The index with the highest value, the first of several.
fn highest<T>(items: &[T], value: impl Fn(&T) -> f64) -> Option<usize> {
    (0..items.len()).max_by(|&a, &b| value(&items[a]).total_cmp(&value(&items[b])).then(b.cmp(&a)))
}

/// Puts the parts of a cut in the place of the part that it cuts: the first there, the others at the end.
fn replace(
    parts: &mut Vec<Part>,
    cuts: &mut Vec<Option<Cut>>,
    at: usize,
    cut: Cut,
    whole: f64,
    solid: &Surface,
) {
    let further: Vec<Option<Cut>> = cut.parts.par_iter().map(|p| best_cut(p, whole, solid)).collect();
    for (k, (part, next)) in cut.parts.into_iter().zip(further).enumerate() {
        if k == 0 {
            (parts[at], cuts[at]) = (part, next);
        } else {
            parts.push(part);
            cuts.push(next);
        }
    }
}

/// Corners that the hull needs, in order of their index.
pub(super) fn corners(hull: &ConvexHull) -> Vec<Point3<f64>> {
    let used: std::collections::BTreeSet<u32> = hull.triangles().iter().flatten().copied().collect();
    used.iter().map(|&i| hull.points()[i as usize]).collect()
}

/// A way to cut a part.
struct Cut {
    /// Volume of hulls that it saves for each further piece, m³.
    worth: f64,
    parts: Vec<Part>,
}

impl Cut {
    fn new(part: &Part, parts: Vec<Part>) -> Option<Self> {
        let left: f64 = parts.iter().map(|p| p.hull_volume).sum();
        (parts.len() > 1).then(|| Self {
            worth: (part.hull_volume - left) / (parts.len() - 1) as f64,
            parts,
        })
    }
}

fn best_cut(part: &Part, whole: f64, solid: &Surface) -> Option<Cut> {
    let mut directions: Vec<Vector3<f64>> = vec![Vector3::x(), Vector3::y(), Vector3::z()];
    for principal in part.principal_directions() {
        if directions
            .iter()
            .all(|d| d.dot(&principal).abs() < SAME_DIRECTION)
        {
            directions.push(principal);
        }
    }
    let planes: Vec<Plane> = directions.iter().flat_map(|d| planes_across(part, d)).collect();
    let large = part.hull_volume >= LARGE * whole;
    let across = planes.par_iter().map(|plane| {
        let sides = [part.below(plane, solid)?, part.below(&plane.flipped(), solid)?];
        let mut best = Cut::new(part, sides.to_vec())?;
        if large {
            for (k, side) in sides.iter().enumerate() {
                for n in WEDGES_BESIDE {
                    let Some(mut parts) = side.wedges(&plane.normal, n, 0.0, solid) else {
                        continue;
                    };
                    parts.push(sides[1 - k].clone());
                    best = better(best, Cut::new(part, parts));
                }
            }
        }
        Some(best)
    });
    let turns: Vec<(Vector3<f64>, usize, f64)> = directions
        .iter()
        .flat_map(|d| WEDGES.map(|n| [(*d, n, 0.0), (*d, n, 0.5)]))
        .flatten()
        .collect();
    let around = turns
        .par_iter()
        .map(|(direction, n, phase)| Cut::new(part, part.wedges(direction, *n, *phase, solid)?));
    let found: Vec<Option<Cut>> = across.chain(around).collect();
    found
        .into_iter()
        .flatten()
        .reduce(|best, next| if next.worth > best.worth { next } else { best })
}

fn better(best: Cut, next: Option<Cut>) -> Cut {
    match next {
        Some(next) if next.worth > best.worth => next,
        _ => best,
    }
}

fn planes_across(part: &Part, direction: &Vector3<f64>) -> Vec<Plane> {
    let (low, high) = part.extent(direction);
    let even = (1..=PLACES).map(|k| low + (high - low) * k as f64 / (PLACES + 1) as f64);
    let beside = BESIDE * (high - low);
    let flat = part.levels(direction, LEVELS);
    let flat = flat
        .into_iter()
        .flat_map(|level| [level - beside, level + beside]);
    even.chain(flat)
        .filter(|place| *place > low && *place < high)
        .map(|offset| Plane {
            normal: *direction,
            offset,
        })
        .collect()
}

/// For each part, the largest distance from the surface of points on its hull's faces that lie outside of the object.
fn deviations(parts: &[Part], surface: &Surface) -> Vec<f64> {
    let of_face = |[a, b, c]: [Point3<f64>; 3]| -> f64 {
        let longest = (b - a).norm().max((c - a).norm()).max((c - b).norm());
        let n = (longest / SAMPLES).ceil().clamp(1.0, MOST_SAMPLES) as usize;
        let mut farthest: f64 = 0.0;
        for i in 0..=n {
            for j in 0..=n - i {
                let (s, t) = (i as f64 / n as f64, j as f64 / n as f64);
                let p = a + (b - a) * s + (c - a) * t;
                let distance = surface.closest_point(&p).distance;
                if distance > farthest && !surface.is_inside(&p) {
                    farthest = distance;
                }
            }
        }
        farthest
    };
    let of_part = |part: &Part| -> f64 {
        let hull = part.hull();
        let faces = hull
            .iter()
            .flat_map(|h| h.triangles().iter().map(|t| t.map(|i| h.points()[i as usize])));
        faces.map(of_face).fold(0.0, f64::max)
    };
    parts.par_iter().map(of_part).collect()
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
        assert!(one.volume_deviation.abs() < 1e-9 && one.surface_deviation < 1e-9);
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

    /// An open cylinder with a floor: radius 40 mm, wall and floor 3 mm, 100 mm high.
    fn cup() -> TriMesh {
        let n = 48;
        let profile = [
            (0.0, 0.0),
            (0.04, 0.0),
            (0.04, 0.1),
            (0.037, 0.1),
            (0.037, 0.003),
            (0.0, 0.003),
        ];
        let mut vertices = Vec::new();
        for (r, z) in profile {
            for k in 0..n {
                let turn = std::f64::consts::TAU * f64::from(k) / f64::from(n);
                vertices.push(Point3::new(r * turn.cos(), r * turn.sin(), z));
            }
        }
        let mut triangles = Vec::new();
        for ring in 0..profile.len() as u32 - 1 {
            for k in 0..n as u32 {
                let (a, b) = (ring * n as u32 + k, ring * n as u32 + (k + 1) % n as u32);
                let (c, d) = (a + n as u32, b + n as u32);
                triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        TriMesh::new(vertices, triangles).unwrap()
    }

    #[test]
    fn the_pieces_of_a_cup_leave_its_inside_open() {
        let cup = cup();
        let pieces = convex_pieces(&cup);
        assert!(
            (0.0..0.06).contains(&pieces.volume_deviation),
            "{}",
            pieces.volume_deviation
        );
        assert!(pieces.surface_deviation < 1e-3, "{}", pieces.surface_deviation);
        assert!(pieces.pieces.len() <= 40, "{}", pieces.pieces.len());
    }

    #[test]
    fn nothing_of_the_inside_is_lost() {
        // A ball on a plate: no few pieces are exact, and their corners lie inside the ball.
        let ball = Solid::Sphere { radius: 0.05 }.display_mesh();
        let plate = Solid::Cuboid {
            half_extents: Vector3::new(0.1, 0.1, 0.01),
        }
        .display_mesh()
        .transformed(&nalgebra::Isometry3::translation(0.0, 0.0, -0.2));
        let n = ball.vertices().len() as u32;
        let vertices = [ball.vertices(), plate.vertices()].concat();
        let moved = plate.triangles().iter().map(|t| t.map(|i| i + n));
        let triangles = ball.triangles().iter().copied().chain(moved).collect();
        let mesh = TriMesh::new(vertices, triangles).unwrap();
        let pieces = convex_pieces(&mesh);
        assert!(
            (-1e-9..0.051).contains(&pieces.volume_deviation),
            "{}",
            pieces.volume_deviation
        );
        // Cut by hand, eight octants of the ball have its volume.
        let part = Part::of(&ball).unwrap();
        let solid = Surface::new(ball);
        let halves = |part: &Part, normal: Vector3<f64>| -> Vec<Part> {
            let plane = Plane { normal, offset: 0.0 };
            [plane, plane.flipped()]
                .iter()
                .map(|p| part.below(p, &solid).unwrap())
                .collect()
        };
        let octants: f64 = halves(&part, Vector3::x())
            .iter()
            .flat_map(|p| halves(p, Vector3::y()))
            .flat_map(|p| halves(&p, Vector3::z()))
            .map(|p| p.hull_volume)
            .sum();
        assert!((octants / part.hull_volume - 1.0).abs() < 1e-9, "{octants}");
    }
}
