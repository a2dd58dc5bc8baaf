//! How far the origin is from a convex set.

use nalgebra::{SMatrix, SVector};

use crate::GraspWrenchSpace;
use crate::hyperplane::{dot, sub};

/// Distance from the origin to the wrench space; 0 where the origin lies in it (also on its boundary, to 1e-12 of the
/// largest wrench norm). Flat spaces are as welcome as full ones.
///
/// Wolfe's method: keep a few affinely independent points (the corral), find the point of their hull nearest the
/// origin, add the support point that lies nearest the origin's side, drop corners that no longer count.
///
/// Source: Wolfe, "Finding the nearest point in a polytope", Mathematical Programming 11 (1976).
pub fn origin_distance(space: &GraspWrenchSpace) -> f64 {
    let x = nearest(|d| space.scaled_support(d), space.scaled_size());
    dot(&x, &x).sqrt() * space.largest_norm()
}

/// The point nearest the origin of the convex set with this support function, whose points are about `size` long; the
/// origin itself where it is no farther than 1e-12 × `size`.
pub(crate) fn nearest(support: impl Fn(&[f64; 6]) -> (f64, [f64; 6]), size: f64) -> [f64; 6] {
    let tolerance = 1e-13 * size;
    let (_, first) = support(&[-1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let mut corral = vec![(first, 1.0)];
    let mut x = first;
    let mut best = x;
    // A few dozen steps are usual; the bound only stops a cycle that rounding might start.
    for _ in 0..1000 {
        let length = dot(&x, &x).sqrt();
        if length < dot(&best, &best).sqrt() {
            best = x;
        }
        if length <= 10.0 * tolerance {
            return [0.0; 6];
        }
        let (reach, point) = support(&x.map(|c| -c / length));
        // No point of the set is nearer to the origin than −reach.
        if length + reach <= tolerance || corral.iter().any(|(c, _)| *c == point) {
            break;
        }
        corral.push((point, 0.0));
        x = shrink_to_nearest(&mut corral);
    }
    best
}

/// Drops corners until the nearest point of the corral's affine hull lies inside its convex hull; returns that point.
/// Never leaves the corral empty.
fn shrink_to_nearest(corral: &mut Vec<([f64; 6], f64)>) -> [f64; 6] {
    while corral.len() > 1 {
        let Some(weights) = affine_minimum(corral) else {
            // Dependent corners: the newest brings nothing new.
            corral.pop();
            break;
        };
        if weights.iter().take(corral.len()).all(|&w| w > 0.0) {
            for (corner, weight) in corral.iter_mut().zip(weights.iter()) {
                corner.1 = *weight;
            }
            break;
        }
        // Go from the old weights towards the new ones until the first reaches 0, and drop that corner.
        let mut step = 1.0_f64;
        let mut leaving = 0;
        for (i, (corner, weight)) in corral.iter().zip(weights.iter()).enumerate() {
            if *weight <= 0.0 {
                let at = if corner.1 > 0.0 {
                    corner.1 / (corner.1 - weight)
                } else {
                    0.0
                };
                if at < step || (at <= step && corral[leaving].1 > 0.0 && corner.1 == 0.0) {
                    step = at;
                    leaving = i;
                }
            }
        }
        for (corner, weight) in corral.iter_mut().zip(weights.iter()) {
            corner.1 += step * (weight - corner.1);
        }
        corral.remove(leaving);
    }
    let total: f64 = corral.iter().map(|(_, w)| w).sum();
    let total = if total > 0.0 { total } else { 1.0 };
    std::array::from_fn(|k| corral.iter().map(|(p, w)| w * p[k]).sum::<f64>() / total)
}

/// Weights, summing to 1, of the point of the corners' affine hull that is nearest the origin; none where the corners
/// are affinely dependent. Solved by modified Gram–Schmidt on the edges from the first corner.
fn affine_minimum(corral: &[([f64; 6], f64)]) -> Option<SVector<f64, 7>> {
    let n = corral.len() - 1;
    if n > 6 {
        return None;
    }
    let origin = corral[0].0;
    let mut q = [[0.0; 6]; 6];
    let mut r = SMatrix::<f64, 6, 6>::zeros();
    for j in 0..n {
        let edge = sub(&corral[j + 1].0, &origin);
        let size = dot(&edge, &edge).sqrt();
        let mut v = edge;
        for _ in 0..2 {
            for i in 0..j {
                let along = dot(&v, &q[i]);
                r[(i, j)] += along;
                for k in 0..6 {
                    v[k] -= along * q[i][k];
                }
            }
        }
        let length = dot(&v, &v).sqrt();
        if length <= 1e-12 * size {
            return None;
        }
        r[(j, j)] = length;
        q[j] = v.map(|c| c / length);
    }
    // Minimise |origin + Q R w|: R w = −Qᵀ origin.
    let mut w = [0.0; 6];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| r[(i, j)] * w[j]).sum();
        w[i] = (-dot(&q[i], &origin) - known) / r[(i, i)];
    }
    let mut weights = SVector::<f64, 7>::zeros();
    weights[0] = 1.0 - w[..n].iter().sum::<f64>();
    for j in 0..n {
        weights[j + 1] = w[j];
    }
    Some(weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Contact, QualityOptions};
    use nalgebra::{Point3, Vector3};

    fn distance(contacts: &[(Vector3<f64>, [f64; 3], f64)]) -> f64 {
        let contacts: Vec<Contact> = contacts
            .iter()
            .enumerate()
            .map(|(i, (n, p, mu))| Contact::new(i, (*p).into(), *n, *mu, 0.0).unwrap())
            .collect();
        let options = QualityOptions::new(Point3::origin(), 1.0);
        origin_distance(&GraspWrenchSpace::new(&contacts, &options).unwrap())
    }

    #[test]
    fn one_contact_through_the_center_is_at_distance_one() {
        // Its cone's centre is the wrench (n, 0), the point nearest the origin.
        assert!((distance(&[(Vector3::z(), [0.0; 3], 0.5)]) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn opposite_contacts_hold_the_origin_in_their_flat_space() {
        let pair = [
            (Vector3::x(), [-1.0, 0.0, 0.0], 0.5),
            (-Vector3::x(), [1.0, 0.0, 0.0], 0.5),
        ];
        assert_eq!(distance(&pair), 0.0);
    }

    #[test]
    fn frictionless_contacts_at_right_angles_are_at_distance_sqrt_half() {
        let pair = [(Vector3::x(), [0.0; 3], 0.0), (Vector3::y(), [0.0; 3], 0.0)];
        assert!((distance(&pair) - 0.5_f64.sqrt()).abs() < 1e-12);
    }
}
