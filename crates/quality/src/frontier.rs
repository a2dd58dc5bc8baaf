//! The part of a growing polytope's boundary that is nearer to the origin than some radius.
//!
//! ε needs the facets that are nearer to the origin than the best bound so far; nine in ten of those that a whole
//! polytope makes lie farther out. Planes with a unit normal that are at least `radius` from the origin form a convex
//! cone (n, o), o ≥ radius |n|, and the plane of a new facet is a positive combination of two old ones. So where both
//! are far, the new one is far as well, and never needs to be made. A facet that is near, in contrast, keeps for each
//! of its ridges the plane at the far end of the *edge* there: all planes through the ridge, from the facet's own to its
//! neighbour's. If the neighbour is far, any far plane of that edge stands in for it (an *end*): whatever a new point
//! cuts off the edge beyond it is far too.
//!
//! A point may see facets in many places that only far ones connect, so nothing is flooded: all near facets are
//! measured. They are few, and each measures itself and its six ends in one pass.

use crate::edges::{
    OWN, Row, column, end_beside, end_heights, far_end, height, near, pencil, rise, row, set_column, set_end,
};
use crate::facet::{Crossing, Entry, Facet, Link, fingerprint};
use crate::hyperplane::{Hyperplane, dot, through_points};

/// The near facets. Cleared and filled again, it keeps its memory. Points have six coordinates; those past `n_axes` are
/// 0 in every point and every normal.
#[derive(Debug, Clone, Default)]
pub(crate) struct Frontier {
    n_axes: usize,
    points: Vec<[f64; 6]>,
    fingerprints: Vec<u64>,
    /// A point well inside.
    inside: [f64; 6],
    /// How far over a plane a point must stand to see it.
    tolerance: f64,
    facets: Vec<Facet>,
    /// Each facet's plane, and how much higher the near planes of its edges get (for a point of length 1). Planes of
    /// places that are free are infinitely far.
    own: Vec<[f64; 8]>,
    free: Vec<u32>,
    gone: Vec<u32>,
    crossings: Vec<Crossing>,
    /// New facets, one a crossing.
    fresh: Vec<u32>,
    table: Vec<Entry>,
    round: u64,
}

/// The structure contradicts itself, by rounding: the whole polytope must decide.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Doubt;

impl Frontier {
    /// Starts again from a simplex of `n_axes` + 1 points. False where the simplex is too flat to have planes.
    pub(crate) fn reset(&mut self, simplex: &[[f64; 6]], tolerance: f64) -> bool {
        let n = simplex.len() - 1;
        self.n_axes = n;
        self.tolerance = tolerance;
        self.points.clear();
        self.fingerprints.clear();
        self.facets.clear();
        self.own.clear();
        self.free.clear();
        for point in simplex {
            self.push_point(point);
        }
        self.inside = std::array::from_fn(|k| simplex.iter().map(|p| p[k]).sum::<f64>() / (n + 1) as f64);
        for left_out in 0..=n {
            let corners = std::array::from_fn(|i| {
                if i < n {
                    (i + usize::from(i >= left_out)) as u16
                } else {
                    0
                }
            });
            let Some(plane) = through_points(&self.corner_points(&corners), &self.inside) else {
                return false;
            };
            let plane = row(plane);
            let mut facet = Facet {
                planes: [[0.0; 8]; 8],
                corners,
                links: [Link::FAR; 6],
            };
            set_column(&mut facet.planes, OWN, &plane);
            self.own.push(own_row(&plane));
            self.facets.push(facet);
        }
        // The facet without corner c is facet c; it lies across the edge that leaves corner c.
        for place in 0..=n {
            for slot in 0..n {
                let across = usize::from(self.facets[place].corners[slot]);
                let back = (0..n).find(|&i| usize::from(self.facets[across].corners[i]) == place);
                let plane = column(&self.facets[across].planes, OWN);
                set_end(&mut self.facets[place].planes, slot, &plane);
                self.facets[place].links[slot] = Link::new(across, back.unwrap_or(0));
            }
        }
        true
    }

    fn push_point(&mut self, point: &[f64; 6]) {
        self.fingerprints.push(fingerprint(self.points.len() as u64 + 1));
        self.points.push(*point);
    }

    /// The facet nearest to the origin, and its signed distance.
    pub(crate) fn nearest(&self) -> Option<(usize, f64)> {
        let mut best = (0, f64::INFINITY);
        for (place, own) in self.own.iter().enumerate() {
            let offset = -own[6];
            if offset < best.1 {
                best = (place, offset);
            }
        }
        (best.1 < f64::INFINITY).then_some(best)
    }

    /// The plane of a facet.
    pub(crate) fn plane(&self, place: usize) -> Hyperplane<6> {
        let row = column(&self.facets[place].planes, OWN);
        Hyperplane {
            normal: std::array::from_fn(|k| row[k]),
            offset: -row[6],
        }
    }

    /// How many facets there are.
    pub(crate) fn n_facets(&self) -> usize {
        self.facets.len() - self.free.len()
    }

    /// Whether this very point was inserted before.
    pub(crate) fn has_point(&self, point: &[f64; 6]) -> bool {
        self.points.iter().any(|p| p == point)
    }

    /// How many points there are.
    pub(crate) fn n_points(&self) -> usize {
        self.points.len()
    }

    /// Adds a point. Facets that are nearer than `radius` are made; `radius` must not grow from call to call.
    pub(crate) fn insert(&mut self, point: &[f64; 6], radius: f64) -> Result<(), Doubt> {
        let corner = self.points.len() as u16;
        self.push_point(point);
        self.round += 1;
        self.cut(point, radius);
        self.make(point, corner, radius)?;
        for &place in &self.gone {
            self.own[place as usize][6] = f64::NEG_INFINITY;
            self.free.push(place);
        }
        Ok(())
    }

    /// Finds the facets that see the point, and where its plane crosses near edges.
    fn cut(&mut self, point: &[f64; 6], radius: f64) {
        self.gone.clear();
        self.crossings.clear();
        let slots = (1_u32 << self.n_axes) - 1;
        let length = dot(point, point).sqrt();
        for place in 0..self.own.len() {
            let own = &self.own[place];
            let [normal @ .., rises] = own;
            if height(normal, point) + rises * length <= 0.0 {
                continue;
            }
            let facet = &self.facets[place];
            let heights = end_heights(&facet.planes, point);
            let mut above = 0_u32;
            for (k, h) in heights.iter().enumerate() {
                above |= u32::from(*h > self.tolerance) << k;
            }
            let base_is_seen = above >> OWN & 1 == 1;
            if base_is_seen {
                self.gone.push(place as u32);
            }
            let crossed = if base_is_seen { !above } else { above } & slots;
            if crossed == 0 {
                continue;
            }
            let near = near(&facet.planes, &heights, radius);
            let mut open = crossed;
            while open != 0 {
                let slot = open.trailing_zeros() as usize;
                open &= open - 1;
                let is_near = near >> slot & 1 == 1;
                let facet = &self.facets[place];
                let link = facet.links[slot];
                // Between two facets the seen one does the work.
                if is_near && (base_is_seen || !link.is_facet()) {
                    let (from, to) = if base_is_seen { (OWN, slot) } else { (slot, OWN) };
                    let seen = column(&facet.planes, from);
                    self.crossings.push(Crossing {
                        plane: pencil(&seen, heights[from], &column(&facet.planes, to), heights[to]),
                        seen,
                        height: heights[from],
                        base: place as u32,
                        base_is_seen,
                        slot,
                    });
                } else if base_is_seen && link.is_facet() {
                    let end = column(&facet.planes, slot);
                    let plane = pencil(&column(&facet.planes, OWN), heights[OWN], &end, heights[slot]);
                    let kept = &mut self.facets[link.place()];
                    set_end(&mut kept.planes, link.slot(), &plane);
                    kept.links[link.slot()] = Link::FAR;
                    let rises = rise(&kept.planes, link.slot(), radius);
                    let own = &mut self.own[link.place()];
                    own[7] = own[7].max(rises);
                }
            }
        }
    }

    /// Makes the near facets at the crossings and joins them.
    fn make(&mut self, point: &[f64; 6], corner: u16, radius: f64) -> Result<(), Doubt> {
        let wanted = (16 * self.crossings.len()).next_power_of_two().max(64);
        if self.table.len() < wanted {
            self.table.clear();
            self.table.resize(wanted, Entry::default());
        }
        self.fresh.clear();
        let crossings = std::mem::take(&mut self.crossings);
        let mut made = crossings.iter().try_for_each(|c| self.make_facet(c, corner));
        if made.is_ok() {
            made = (0..crossings.len())
                .try_for_each(|i| self.end_edges(&crossings[i], self.fresh[i], point, radius));
        }
        self.crossings = crossings;
        made
    }

    fn make_facet(&mut self, crossing: &Crossing, corner: u16) -> Result<(), Doubt> {
        let n = self.n_axes;
        let Crossing { base, slot, .. } = *crossing;
        let base_facet = &self.facets[base as usize];
        let mut corners = base_facet.corners;
        corners[slot] = corner;
        let mut plane = crossing.plane;
        if self.off_corners(&corners, &plane) > OFF_CORNERS
            && let Some(solved) = self.solved(&corners, &plane)
        {
            plane = solved;
        }
        let mut planes = [[0.0; 8]; 8];
        let (kept, link) = if crossing.base_is_seen {
            (column(&base_facet.planes, slot), base_facet.links[slot])
        } else {
            (column(&base_facet.planes, OWN), Link::new(base as usize, slot))
        };
        set_column(&mut planes, OWN, &plane);
        set_end(&mut planes, slot, &kept);
        let mut links = [Link::UNSET; 6];
        links[slot] = link;
        let place = self.add(
            Facet {
                planes,
                corners,
                links,
            },
            &plane,
        );
        self.fresh.push(place as u32);
        if link.is_facet() {
            let kept = &mut self.facets[link.place()];
            set_end(&mut kept.planes, link.slot(), &plane);
            kept.links[link.slot()] = Link::new(place, slot);
        }
        let all = corners[..n]
            .iter()
            .fold(0, |all, &c| all ^ self.fingerprints[usize::from(c)]);
        for i in 0..n {
            if i != slot && !self.join(all ^ self.fingerprints[usize::from(corners[i])], place, i) {
                return Err(Doubt);
            }
        }
        Ok(())
    }

    /// Joins a new facet to the one that has the same ridge with the new point, if that one is already there.
    /// False where two facets have it already.
    fn join(&mut self, ridge: u64, place: usize, slot: usize) -> bool {
        let mask = self.table.len() - 1;
        let mut at = ridge as usize & mask;
        loop {
            let entry = self.table[at];
            if entry.round != self.round {
                self.table[at] = Entry {
                    ridge,
                    round: self.round,
                    link: Link::new(place, slot),
                };
                return true;
            }
            if entry.ridge == ridge {
                let link = entry.link;
                if !link.is_facet() {
                    return false;
                }
                self.table[at].link = Link::UNSET;
                let (here, there) = (
                    column(&self.facets[place].planes, OWN),
                    column(&self.facets[link.place()].planes, OWN),
                );
                set_end(&mut self.facets[place].planes, slot, &there);
                self.facets[place].links[slot] = link;
                let other = &mut self.facets[link.place()];
                set_end(&mut other.planes, link.slot(), &here);
                other.links[link.slot()] = Link::new(place, slot);
                return true;
            }
            at = (at + 1) & mask;
        }
    }

    /// Edges of a new facet that were not joined end far out.
    fn end_edges(
        &mut self,
        crossing: &Crossing,
        place: u32,
        point: &[f64; 6],
        radius: f64,
    ) -> Result<(), Doubt> {
        let place = place as usize;
        let plane = column(&self.facets[place].planes, OWN);
        let mut rises = 0.0_f64;
        for slot in 0..self.n_axes {
            let link = self.facets[place].links[slot];
            if link == Link::UNSET {
                let beside = column(&self.facets[crossing.base as usize].planes, slot);
                let end = match end_beside(&plane, &crossing.seen, crossing.height, &beside, point, radius) {
                    Some(end) => end,
                    None => self.solved_end(place, slot, radius)?,
                };
                self.facets[place].links[slot] = Link::FAR;
                set_end(&mut self.facets[place].planes, slot, &end);
            }
            if !link.is_facet() {
                rises = rises.max(rise(&self.facets[place].planes, slot, radius));
            }
        }
        self.own[place][7] = self.own[place][7].max(rises);
        Ok(())
    }

    /// The far end of the edge that leaves a corner, from the points of its ridge alone: where the planes on either
    /// side of the edge are the same, they do not tell where it leads.
    fn solved_end(&self, place: usize, slot: usize, radius: f64) -> Result<Row, Doubt> {
        let facet = &self.facets[place];
        let own = column(&facet.planes, OWN);
        // The plane through the ridge at right angles to the facet; the corner lies below it.
        let mut points = self.corner_points(&facet.corners);
        let anchor = points[usize::from(slot == 0)];
        points[slot] = std::array::from_fn(|k| anchor[k] + own[k]);
        let inside = &self.points[usize::from(facet.corners[slot])];
        let across = through_points(&points, inside).map(row).ok_or(Doubt)?;
        far_end(&own, &across, radius).ok_or(Doubt)
    }

    fn add(&mut self, facet: Facet, plane: &Row) -> usize {
        if let Some(place) = self.free.pop() {
            let place = place as usize;
            self.facets[place] = facet;
            self.own[place] = own_row(plane);
            place
        } else {
            self.facets.push(facet);
            self.own.push(own_row(plane));
            self.facets.len() - 1
        }
    }

    /// The corners' points; slots past the axes hold points off the first along the axes that do not count.
    fn corner_points(&self, corners: &[u16; 6]) -> [[f64; 6]; 6] {
        let first = self.points[usize::from(corners[0])];
        std::array::from_fn(|i| {
            if i < self.n_axes {
                self.points[usize::from(corners[i])]
            } else {
                std::array::from_fn(|k| first[k] + f64::from(u8::from(i == k)))
            }
        })
    }

    /// The largest distance of a corner from the plane.
    fn off_corners(&self, corners: &[u16; 6], plane: &Row) -> f64 {
        let normal = std::array::from_fn(|k| plane[k]);
        let mut most = 0.0_f64;
        for &c in &corners[..self.n_axes] {
            most = most.max((dot(&normal, &self.points[usize::from(c)]) + plane[6]).abs());
        }
        most
    }

    /// The plane through the corners, if it is well determined and near `about`.
    fn solved(&self, corners: &[u16; 6], about: &Row) -> Option<Row> {
        let plane = row(through_points(&self.corner_points(corners), &self.inside)?);
        let turn: f64 = (0..6).map(|k| plane[k] * about[k]).sum();
        (turn > 1.0 - 1e-6).then_some(plane)
    }
}

/// A plane in the list of all, with nothing known of its edges.
fn own_row(plane: &Row) -> [f64; 8] {
    std::array::from_fn(|k| if k < 7 { plane[k] } else { 0.0 })
}

/// A plane may pass its corners by this much before it is solved anew.
const OFF_CORNERS: f64 = 1e-14;

#[cfg(test)]
mod tests {
    use super::*;

    /// A cross of six axes; the last one's negative half is short.
    fn corner(axis: usize, side: f64) -> [f64; 6] {
        let length = if axis == 5 && side < 0.0 { 0.5 } else { 1.0 };
        std::array::from_fn(|k| if k == axis { side * length } else { 0.0 })
    }

    fn cross(radius: f64) -> Frontier {
        let mut frontier = Frontier::default();
        let simplex: [[f64; 6]; 7] =
            std::array::from_fn(|i| if i < 6 { corner(i, 1.0) } else { corner(0, -1.0) });
        assert!(frontier.reset(&simplex, 1e-13));
        for axis in 1..6 {
            frontier.insert(&corner(axis, -1.0), radius).unwrap();
        }
        frontier
    }

    #[test]
    fn with_a_radius_beyond_all_it_is_the_whole_boundary() {
        let frontier = cross(10.0);
        assert_eq!(frontier.n_facets(), 64);
        let (facet, offset) = frontier.nearest().unwrap();
        assert!((offset - 1.0 / 3.0).abs() < 1e-15);
        assert!((frontier.plane(facet).normal[5] + 2.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn facets_beyond_the_radius_are_not_made() {
        // Half of the facets are at 1/3, the others at 1/√6.
        let frontier = cross(0.36);
        // Two of the simplex's own are left.
        assert_eq!(frontier.n_facets(), 32 + 2);
        assert!((frontier.nearest().unwrap().1 - 1.0 / 3.0).abs() < 1e-15);
        let frontier = cross(0.3);
        assert_eq!(frontier.n_facets(), 2);
        assert!(frontier.nearest().unwrap().1 > 0.3);
    }

    #[test]
    fn a_flat_simplex_is_refused() {
        let simplex = std::array::from_fn::<_, 7, _>(|i| corner(i % 5, 1.0 + i as f64));
        assert!(!Frontier::default().reset(&simplex, 1e-13));
    }
}
