//! The handle of a mug or jug: a tube from one hole in a vessel's front to another below it.

use super::curve::{Corner, evenly, rounded};
use super::model::{PartBox, boxes_along};
use super::shell::{Hole, Part, Ring, Shell};
use super::sweep::{around_hole, frames_in_xz, place, superellipse};

/// Shape of a handle in the x–z plane and of its section.
#[derive(Debug)]
pub struct Ear<'a> {
    /// Corners of the middle line between the two holes, (x, z, rounding), from top to bottom.
    pub path: &'a [Corner],
    /// Sections along it.
    pub sections: usize,
    /// Half the width (y) and half the thickness at both ends and in the middle.
    pub half: [[f64; 2]; 3],
    /// Of the section in the middle: 2 for an ellipse, more for a flat strap. Towards the feet it becomes rectangular.
    pub power: f64,
}

/// Grows the ear from `top` to `bottom`, two holes of the same size in `rings`, and gives the boxes around it.
pub fn grow(shell: &mut Shell, rings: &[Ring], top: &Hole, bottom: &Hole, ear: &Ear) -> Vec<PartBox> {
    shell.start(Part::Handle);
    let (start, end) = (top.edge(rings), bottom.edge_of_arrival(rings));
    let from = shell.mean(&start);
    let to = shell.mean(&end);
    let mut corners = vec![Corner(from.x, from.z, 0.0)];
    corners.extend_from_slice(ear.path);
    corners.push(Corner(to.x, to.z, 0.0));
    let frames = frames_in_xz(&evenly(&rounded(&corners, 2.0), ear.sections));
    let angles = around_hole(top.columns.len(), top.rows.len());
    let n = ear.sections as f64;
    let mut tube = vec![start];
    for (i, frame) in frames.iter().enumerate().take(ear.sections).skip(1) {
        // Ends are where u is 1; the section is within a few per cent of the middle's over the inner half.
        let u = (2.0 * i as f64 / n - 1.0).abs().powi(4);
        let thick_end = if 2 * i < ear.sections {
            ear.half[0]
        } else {
            ear.half[2]
        };
        let [a, b] = [0, 1].map(|k| ear.half[1][k] + u * (thick_end[k] - ear.half[1][k]));
        let power = ear.power + u * (5.0 - ear.power);
        let section = angles.iter().map(|&angle| superellipse(angle, a, b, power));
        tube.push(place(shell, frame, section));
    }
    tube.push(end);
    shell.weave(&tube, &[]);
    shell.start(Part::Body);
    boxes_along(shell, &tube[1..tube.len() - 1], 5)
}
