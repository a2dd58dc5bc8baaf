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
    // Neighbours across edges and corners of a cell, too: sides go farther along them where the surface is oblique.
    let lengths = [0.0, 1.0, 2.0_f64.sqrt(), 3.0_f64.sqrt()].map(|steps| steps * size * (1.0 + 1e-6));
    let strides = [1, counts[0], counts[0] * counts[1]];
    loop {
        while let Some(i) = stack.pop() {
            let at: [usize; 3] = std::array::from_fn(|k| i / strides[k] % counts[k]);
            for step in 0..27 {
                let steps = [step % 3, step / 3 % 3, step / 9];
                if (0..3).any(|k| at[k] + steps[k] == 0 || at[k] + steps[k] > counts[k]) {
                    continue;
                }
                let j = (0..3).map(|k| (at[k] + steps[k] - 1) * strides[k]).sum::<usize>();
                let n_steps = steps.iter().filter(|s| **s != 1).count();
                let apart = f64::from(distances[i]) + f64::from(distances[j]);
                if known[j].is_none() && apart > lengths[n_steps] {
                    known[j] = known[i];
                    stack.push(j);
                }
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
