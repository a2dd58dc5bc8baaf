//! Which side of a surface the nodes of a grid are on.
//!
//! Signs spread from node to node where no surface can lie between: two neighbours h apart whose distances add up to more
//! than h. Regions that this does not reach, and nodes near holes, ask for their winding number.

use nalgebra::Point3;

use crate::holes::Holes;
use crate::winding::WindingTree;

/// Which side of the surface a point is on.
#[derive(Debug)]
pub(crate) struct Sides {
    /// The surface's bounds.
    pub(crate) low: Point3<f64>,
    pub(crate) high: Point3<f64>,
    pub(crate) holes: Holes,
    pub(crate) winding: WindingTree,
}

impl Sides {
    /// What need not be spread: points beyond the surface's bounds are outside, those near holes are looked at each.
    pub(crate) fn known_at(&self, p: &Point3<f64>, far_from_holes: impl Fn() -> bool) -> Option<bool> {
        let within = (0..3).all(|k| p[k] >= self.low[k] && p[k] <= self.high[k]);
        if within && far_from_holes() {
            None
        } else {
            Some(within && self.winding.is_inside(p))
        }
    }

    pub(crate) fn is_inside(&self, p: &Point3<f64>) -> bool {
        self.winding.is_inside(p)
    }
}

/// Turns distances inside negative: known sides spread to neighbours that no surface can part, `ask` says where they begin.
pub(crate) fn spread(
    distances: &mut [f32],
    counts: [usize; 3],
    size: f64,
    mut known: Vec<Option<bool>>,
    ask: impl Fn(usize) -> bool,
) {
    let mut stack: Vec<usize> = (0..distances.len()).filter(|&i| known[i].is_some()).collect();
    let mut next = 0;
    loop {
        while let Some(i) = stack.pop() {
            let mut stride = 1;
            for n in counts {
                let at = i / stride % n;
                let before = (at > 0).then(|| i - stride);
                let after = (at + 1 < n).then(|| i + stride);
                for j in before.into_iter().chain(after) {
                    let apart = f64::from(distances[i]) + f64::from(distances[j]);
                    if known[j].is_none() && apart > size * (1.0 + 1e-6) {
                        known[j] = known[i];
                        stack.push(j);
                    }
                }
                stride *= n;
            }
        }
        let Some(i) = (next..known.len()).find(|&i| known[i].is_none()) else {
            break;
        };
        known[i] = Some(ask(i));
        stack.push(i);
        next = i + 1;
    }
    for (distance, inside) in distances.iter_mut().zip(known) {
        if inside == Some(true) {
            *distance = -*distance;
        }
    }
}
