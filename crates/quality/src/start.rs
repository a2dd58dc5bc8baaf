//! The first simplex, and the first chance to see that the origin lies outside.

use crate::GraspWrenchSpace;
use crate::hyperplane::{dot, sub};

/// The direction in which the space was seen to reach least far, in scaled coordinates: ε is never above `reach`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Least {
    pub(crate) reach: f64,
    pub(crate) direction: [f64; 6],
}

impl Least {
    pub(crate) fn new() -> Self {
        Self {
            reach: f64::INFINITY,
            direction: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        }
    }

    pub(crate) fn see(&mut self, reach: f64, direction: &[f64; 6]) {
        if reach < self.reach {
            self.reach = reach;
            self.direction = *direction;
        }
    }
}

/// Affinely independent points of the space, one more than it has axes, each well off the span of the ones before.
///
/// Points come from the side of the origin that the ones before leave open, as in a search for the point of the space
/// nearest the origin; so most simplices hold the origin, and a space that does not is soon found out. None as soon as
/// some direction reaches no farther than `enough`, or where the space is flat: then `least` has the direction.
pub(crate) fn first_simplex(
    space: &GraspWrenchSpace,
    least: &mut Least,
    enough: f64,
    flat: f64,
) -> Option<[[f64; 6]; 7]> {
    let n_axes = space.n_axes();
    // Most grasps without force closure push to one side: the direction against all of them tells at once.
    let sum = space.scaled_sum();
    let length = dot(sum, sum).sqrt();
    let against = if length > 0.0 {
        sum.map(|c| -c / length)
    } else {
        unit(0)
    };
    let (reach, first) = space.scaled_support(&against);
    least.see(reach, &against);
    if reach <= enough {
        return None;
    }
    let mut simplex = [first; 7];
    let mut span = Span::default();
    for n_points in 1..=n_axes {
        let towards = span.off(&first);
        let length = dot(&towards, &towards).sqrt();
        let mut chosen = None;
        if length > 1e-6 {
            let direction = towards.map(|c| -c / length);
            let (reach, point) = space.scaled_support(&direction);
            least.see(reach, &direction);
            if reach <= enough {
                return None;
            }
            let off = span.off(&sub(&point, &first));
            if dot(&off, &off).sqrt() > WELL_OFF {
                chosen = Some((point, off));
            }
        }
        let (point, off) = match chosen {
            Some(found) => found,
            None => farthest_off(space, &first, &span, least, n_axes),
        };
        let length = dot(&off, &off).sqrt();
        if least.reach <= enough {
            return None;
        }
        if length <= flat {
            // The space lies in a plane through these points; its normal, turned to where it reaches least.
            let normal = span.complement(n_axes, 0);
            for direction in [normal, normal.map(|c| -c)] {
                least.see(space.scaled_support(&direction).0, &direction);
            }
            return None;
        }
        simplex[n_points] = point;
        span.push(off.map(|c| c / length));
    }
    Some(simplex)
}

/// A point this far off the span of the others makes a simplex that is not too thin.
const WELL_OFF: f64 = 0.05;

/// The point farthest off the span, of those that the directions orthogonal to it reach.
fn farthest_off(
    space: &GraspWrenchSpace,
    first: &[f64; 6],
    span: &Span,
    least: &mut Least,
    n_axes: usize,
) -> ([f64; 6], [f64; 6]) {
    let mut best = (*first, [0.0; 6]);
    let mut most = 0.0;
    for which in 0..n_axes - span.n {
        let direction = span.complement(n_axes, which);
        for direction in [direction, direction.map(|c| -c)] {
            let (reach, point) = space.scaled_support(&direction);
            least.see(reach, &direction);
            let off = span.off(&sub(&point, first));
            let length = dot(&off, &off);
            if length > most {
                most = length;
                best = (point, off);
            }
        }
    }
    best
}

fn unit(axis: usize) -> [f64; 6] {
    std::array::from_fn(|k| f64::from(u8::from(k == axis)))
}

/// Up to six orthonormal directions.
#[derive(Default)]
struct Span {
    directions: [[f64; 6]; 6],
    n: usize,
}

impl Span {
    fn push(&mut self, direction: [f64; 6]) {
        self.directions[self.n] = direction;
        self.n += 1;
    }

    /// What is left of `v` off the span; twice is enough (Gram–Schmidt with reorthogonalisation).
    fn off(&self, v: &[f64; 6]) -> [f64; 6] {
        let mut v = *v;
        for _ in 0..2 {
            for s in &self.directions[..self.n] {
                let along = dot(&v, s);
                for k in 0..6 {
                    v[k] -= along * s[k];
                }
            }
        }
        v
    }

    /// The orthonormal direction number `which` off the span, built from the axes that stand farthest off it.
    fn complement(&self, n_axes: usize, which: usize) -> [f64; 6] {
        let mut all = Self {
            directions: self.directions,
            n: self.n,
        };
        loop {
            let off = (0..n_axes).map(|k| all.off(&unit(k)));
            let best = off
                .max_by(|a, b| dot(a, a).total_cmp(&dot(b, b)))
                .unwrap_or_default();
            let length = dot(&best, &best).sqrt();
            let direction = best.map(|c| c / length);
            if all.n == self.n + which {
                return direction;
            }
            all.push(direction);
        }
    }
}
