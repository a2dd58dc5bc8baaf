//! Mass and centre of mass of a solid whose parts differ in density.

use super::shell::{Part, Shell};
use nalgebra::{Point3, Vector3};
use std::collections::{BTreeMap, BTreeSet};

/// Mass and centre of mass of the solid inside `shell`, where `density` says what each part weighs per volume.
///
/// Each part's triangles are closed by fans over their open edges; two parts that meet in a ring close it with the same
/// fan, so the parts' volumes add up to the whole.
pub fn mass_and_center(shell: &Shell, density: impl Fn(Part) -> f64) -> (f64, Point3<f64>) {
    let mut mass = 0.0;
    let mut moment = Vector3::zeros();
    for part in [Part::Body, Part::Handle, Part::Functional] {
        let (volume, first_moment) = volume_and_moment(shell, part);
        mass += density(part) * volume;
        moment += density(part) * first_moment;
    }
    (mass, Point3::from(moment / mass))
}

/// Volume of one part, and its integral of position.
pub fn volume_and_moment(shell: &Shell, part: Part) -> (f64, Vector3<f64>) {
    let own = || {
        shell
            .triangles
            .iter()
            .zip(&shell.parts)
            .filter(move |&(_, &p)| p == part)
            .map(|(t, _)| *t)
    };
    let (mut volume, mut moment) = (0.0, Vector3::zeros());
    let mut add = |a: Point3<f64>, b: Point3<f64>, c: Point3<f64>| {
        let six = a.coords.dot(&b.coords.cross(&c.coords));
        volume += six / 6.0;
        moment += six / 24.0 * (a.coords + b.coords + c.coords);
    };
    let mut open = BTreeSet::new();
    for [a, b, c] in own() {
        add(shell.points[a], shell.points[b], shell.points[c]);
        for edge in [(a, b), (b, c), (c, a)] {
            if !open.remove(&(edge.1, edge.0)) {
                open.insert(edge);
            }
        }
    }
    let mut next: BTreeMap<usize, usize> = open.into_iter().collect();
    while let Some((&start, _)) = next.iter().next() {
        let mut ring = vec![start];
        while let Some(after) = next.remove(&ring[ring.len() - 1]) {
            if after == start {
                break;
            }
            ring.push(after);
        }
        let middle = shell.mean(&ring);
        for k in 0..ring.len() {
            add(
                shell.points[ring[(k + 1) % ring.len()]],
                shell.points[ring[k]],
                middle,
            );
        }
    }
    (volume, moment)
}
