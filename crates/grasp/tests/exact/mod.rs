//! Exact checks of where a hand stands at an object. Nothing here is shared with the closing: heights above convex
//! solids in closed form, minimised over triangles; edges against triangles; points against triangles; solid angles.

use nalgebra::{Isometry3, Point3, Vector3};
use prehend_geometry::{Solid, TriMesh};
use prehend_grasp::LinkContact;
use prehend_hand::{Hand, JointPositions};

type Triangle = [Point3<f64>; 3];

/// What was found of one posture, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Findings {
    /// The deepest that the object's surface lies inside a link, or infinite where surfaces cross or a link is swallowed.
    pub depth: f64,
    /// The farthest that a contact lies from its link.
    pub off_link: f64,
    /// The farthest that a contact lies from the object.
    pub off_object: f64,
}

pub fn check(
    hand: &Hand,
    object: &TriMesh,
    object_from_root: &Isometry3<f64>,
    joints: &JointPositions,
    contacts: &[LinkContact],
) -> Findings {
    let poses = hand.link_poses(joints);
    let triangles: Vec<Triangle> = object.corners().collect();
    let mut depth = 0.0_f64;
    let mut off_link = vec![f64::INFINITY; contacts.len()];
    for (idx, link) in hand.links().iter().enumerate() {
        for placed in &link.collision {
            let object_from_solid = object_from_root * poses.as_slice()[idx] * placed.link_from_solid;
            depth = depth.max(depth_in(&placed.solid, &object_from_solid, &triangles));
            for (contact, off) in contacts.iter().zip(&mut off_link) {
                if contact.link.0 == idx {
                    let local = object_from_solid.inverse_transform_point(&contact.at.point);
                    *off = off.min(distance_to_surface(&placed.solid, &local));
                }
            }
        }
    }
    let off_object = contacts.iter().map(|c| nearest(&triangles, &c.at.point));
    Findings {
        depth,
        off_link: off_link.into_iter().fold(0.0, f64::max),
        off_object: off_object.fold(0.0, f64::max),
    }
}

fn depth_in(solid: &Solid, object_from_solid: &Isometry3<f64>, object: &[Triangle]) -> f64 {
    // Where no surfaces cross, one point of the solid tells whether all of it is inside the object.
    let of_solid = solid.display_mesh();
    let some_point = object_from_solid * of_solid.vertices()[0];
    // Beside an open sheet that is bent around it a point counts as half inside.
    if winding(object, &some_point).abs() > 0.9 {
        return f64::INFINITY;
    }
    // A display mesh may cut the corners of what is round.
    let (low, high) = of_solid.axis_aligned_bounds();
    let (low, high) = (low - Vector3::repeat(1e-3), high + Vector3::repeat(1e-3));
    let reaches = |t: &Triangle| {
        let (l, h) = t.iter().fold((t[0], t[0]), |(l, h), p| (l.inf(p), h.sup(p)));
        (0..3).all(|k| l[k] <= high[k] && h[k] >= low[k])
    };
    let local = object
        .iter()
        .map(|t| t.map(|p| object_from_solid.inverse_transform_point(&p)));
    let near: Vec<Triangle> = local.filter(reaches).collect();
    if let Some(height) = height_above(solid) {
        return near.iter().map(|t| -lowest(&*height, t)).fold(0.0, f64::max);
    }
    let links: Vec<Triangle> = of_solid.corners().collect();
    let crosses = near.iter().any(|t| links.iter().any(|l| cross(t, l)));
    if crosses { f64::INFINITY } else { 0.0 }
}

type Height = Box<dyn Fn(&Point3<f64>) -> f64>;

/// A convex function that is negative exactly inside a convex solid, where it is minus the depth; `None` for a mesh.
fn height_above(solid: &Solid) -> Option<Height> {
    let beyond = |out: Vector3<f64>| out.sup(&Vector3::zeros()).norm() + out.max().min(0.0);
    Some(match solid.clone() {
        Solid::Sphere { radius } => Box::new(move |p| p.coords.norm() - radius),
        Solid::Capsule { half_length, radius } => {
            Box::new(move |p| p.x.hypot(p.y).hypot((p.z.abs() - half_length).max(0.0)) - radius)
        }
        Solid::Cuboid { half_extents } => Box::new(move |p| beyond(p.coords.abs() - half_extents)),
        Solid::Cylinder { half_length, radius } => Box::new(move |p| {
            let out = [p.x.hypot(p.y) - radius, p.z.abs() - half_length];
            out[0].max(0.0).hypot(out[1].max(0.0)) + out[0].max(out[1]).min(0.0)
        }),
        Solid::Hull(points) => {
            let faces: Vec<(Vector3<f64>, f64)> = solid
                .display_mesh()
                .corners()
                .filter_map(|[a, b, c]| {
                    let normal = (b - a).cross(&(c - a)).try_normalize(0.0)?;
                    // Written so that the faces hold all points, whoever made them.
                    let farthest = points
                        .iter()
                        .map(|p| normal.dot(&p.coords))
                        .fold(f64::MIN, f64::max);
                    Some((normal, farthest))
                })
                .collect();
            Box::new(move |p| {
                faces
                    .iter()
                    .map(|(n, d)| n.dot(&p.coords) - d)
                    .fold(f64::MIN, f64::max)
            })
        }
        Solid::Mesh(_) => return None,
    })
}

/// The least of a convex function over a triangle: two nested searches by thirds.
fn lowest(height: &dyn Fn(&Point3<f64>) -> f64, [a, b, c]: &Triangle) -> f64 {
    let center = Point3::from((a.coords + b.coords + c.coords) / 3.0);
    let radius = [a, b, c].iter().map(|p| (*p - center).norm()).fold(0.0, f64::max);
    // No height falls faster than one moves.
    let bound = height(&center) - radius;
    if bound > 0.0 {
        return bound;
    }
    least(1.0, &|u| {
        least(1.0 - u, &|v| height(&(a + (b - a) * u + (c - a) * v)))
    })
}

fn least(end: f64, f: &dyn Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, end);
    let mut best = f(low).min(f(high));
    for _ in 0..50 {
        let (p, q) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        let (at_p, at_q) = (f(p), f(q));
        best = best.min(at_p).min(at_q);
        if at_p < at_q {
            high = q;
        } else {
            low = p;
        }
    }
    best
}

fn distance_to_surface(solid: &Solid, p: &Point3<f64>) -> f64 {
    match (solid, height_above(solid)) {
        (Solid::Mesh(_) | Solid::Hull(_), _) | (_, None) => {
            nearest(&solid.display_mesh().corners().collect::<Vec<_>>(), p)
        }
        (_, Some(height)) => height(p).abs(),
    }
}

fn nearest(triangles: &[Triangle], p: &Point3<f64>) -> f64 {
    triangles
        .iter()
        .map(|t| point_to_triangle(p, t))
        .fold(f64::INFINITY, f64::min)
}

/// By cases: above the face, else the nearest of three edges.
fn point_to_triangle(p: &Point3<f64>, [a, b, c]: &Triangle) -> f64 {
    let normal = (b - a).cross(&(c - a));
    let side = |q: &Point3<f64>, r: &Point3<f64>| (r - q).cross(&(p - q)).dot(&normal);
    if normal.norm() > 0.0 && side(a, b) >= 0.0 && side(b, c) >= 0.0 && side(c, a) >= 0.0 {
        return ((p - a).dot(&normal) / normal.norm()).abs();
    }
    let to_edge = |q: &Point3<f64>, r: &Point3<f64>| {
        let along = r - q;
        let t = ((p - q).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (p - (q + along * t)).norm()
    };
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}

/// Whether an edge of one triangle goes through the other.
fn cross(s: &Triangle, t: &Triangle) -> bool {
    let apart = |k: usize| {
        let range = |t: &Triangle| {
            t.iter()
                .fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[k]), h.max(p[k])))
        };
        let (a, b) = (range(s), range(t));
        a.1 < b.0 || b.1 < a.0
    };
    if (0..3).any(apart) {
        return false;
    }
    let pierces = |edges: &Triangle, [a, b, c]: &Triangle| {
        let volume = |p: &Point3<f64>, q: &Point3<f64>, r: &Point3<f64>, o: &Point3<f64>| {
            (p - o).dot(&(q - o).cross(&(r - o)))
        };
        (0..3).any(|k| {
            let (p, q) = (&edges[k], &edges[(k + 1) % 3]);
            let (on_p, on_q) = (volume(a, b, c, p), volume(a, b, c, q));
            let around = [volume(a, b, q, p), volume(b, c, q, p), volume(c, a, q, p)];
            on_p * on_q < 0.0 && (around.iter().all(|v| *v > 0.0) || around.iter().all(|v| *v < 0.0))
        })
    };
    pierces(s, t) || pierces(t, s)
}

/// How often the triangles wind around a point: the sum of their solid angles over 4π.
fn winding(triangles: &[Triangle], p: &Point3<f64>) -> f64 {
    let angle = |t: &Triangle| {
        let [a, b, c] = t.map(|q| q - p);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        2.0 * a.dot(&b.cross(&c)).atan2(below)
    };
    triangles.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}
