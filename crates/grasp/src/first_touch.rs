//! When do moving bodies first touch?

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Two bodies touch where their gap is at most this, metres. Nothing ever ends closer than [`CLEARANCE`].
pub(crate) const TOUCH: f64 = 1e-4;
/// A smaller gap counts as an overlap, so that rounding in a distance cannot hide one; metres.
pub(crate) const CLEARANCE: f64 = 1e-6;
/// A gap larger than this need not be known exactly to choose the next step, metres.
pub(crate) const NEAR: f64 = 2.5e-3;

/// No gap counts as shrinking slower than this, metres per unit of s: what does not change does not but for rounding.
const SLOWEST: f64 = 1e-9;

/// Gaps between pairs of bodies that move with one parameter s.
pub(crate) trait Motion {
    /// The gap of pair `i` at `s`, metres: 0 or less where the two overlap, `cutoff` where it is that or more.
    fn gap(&self, i: usize, s: f64, cutoff: f64) -> f64;
    /// The same, or any lower bound of it above [`NEAR`].
    fn look(&self, i: usize, s: f64) -> f64;
    /// A bound of how fast points of pair `i` move against each other, metres per unit of s; 0 where it does not move.
    fn speed(&self, i: usize) -> f64;
    /// A bound of how fast what the last look at pair `i` saw can shrink, at most its speed.
    fn closing_speed(&self, i: usize) -> f64;
    /// Where the gap is small, the pair moves this far between two looks, metres: less than the bodies are thick, so
    /// that none can be hopped over.
    fn least_step(&self, i: usize) -> f64;
}

/// What is known of one pair.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Track {
    /// The pair was seen apart here …
    seen: f64,
    /// … by this or more, metres.
    gap: f64,
    /// The next look is due here.
    due: f64,
    /// The pair touches, and may go on moving as long as it does not overlap.
    pub(crate) grazing: bool,
}

impl Track {
    /// Nothing is known yet; the first look is due at `s`.
    pub(crate) fn unknown_at(s: f64) -> Self {
        Self {
            seen: s,
            gap: 0.0,
            due: s,
            grazing: false,
        }
    }

    /// Whether the pair cannot overlap at `s`.
    fn is_apart_at(&self, s: f64, closing_speed: f64) -> bool {
        s == self.seen || self.gap - closing_speed * (s - self.seen).abs() > CLEARANCE
    }

    /// The motion goes on from `s` in another way: what was seen of the old way beyond `s` no longer counts.
    pub(crate) fn go_on_from(&mut self, s: f64, old_closing_speed: f64, motion: &impl Motion, i: usize) {
        self.gap = (self.gap - old_closing_speed * (s - self.seen).abs()).max(0.0);
        self.seen = s;
        let speed = motion.speed(i);
        let sure_step = (self.gap - TOUCH / 2.0) / motion.closing_speed(i).max(SLOWEST);
        self.due = if speed == 0.0 {
            f64::INFINITY
        } else if sure_step >= motion.least_step(i) / speed {
            rounded(s, sure_step)
        } else {
            s
        };
    }
}

/// A little less than `s + step`, so that looks at different pairs often fall together.
fn rounded(s: f64, step: f64) -> f64 {
    // The largest power of two up to a quarter of the step.
    let unit = f64::from_bits(step.to_bits() & (0x7ff << 52)) / 4.0;
    let due = ((s + step) / unit).floor() * unit;
    if due > s { due } else { s + step }
}

/// A look that is due; the earliest comes first.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Look {
    due: f64,
    pair: usize,
}

impl Eq for Look {}

impl Ord for Look {
    fn cmp(&self, other: &Self) -> Ordering {
        other.due.total_cmp(&self.due).then(other.pair.cmp(&self.pair))
    }
}

impl PartialOrd for Look {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The first touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Touch {
    /// The parameter: here every moving pair is apart by more than [`CLEARANCE`].
    pub(crate) s: f64,
    /// The pair that touches; `None` where the end came first.
    pub(crate) pair: Option<usize>,
    /// The pair was grazing and would overlap a little later.
    pub(crate) pressed: bool,
    /// The pair's gap there, metres, if it was asked for.
    pub(crate) gap: Option<f64>,
}

/// The least s from `start` up to `end` at which a pair's gap is in ([`CLEARANCE`], [`TOUCH`]]; pairs that graze must want
/// to overlap. All pairs are apart there.
///
/// Conservative advancement, the earliest look first: each pair is looked at again only when it could have used up its
/// last known gap. Near the object, where such steps would get ever smaller, pairs move at least their least step and an
/// overlap is bisected.
///
/// `Err` names a pair that overlaps at the start.
pub(crate) fn first_touch(
    motion: &impl Motion,
    tracks: &mut [Track],
    start: f64,
    end: f64,
) -> Result<Touch, usize> {
    let mut search = Search {
        motion,
        tracks,
        start,
        touch: Touch {
            s: end,
            pair: None,
            pressed: false,
            gap: None,
        },
    };
    let moving: Vec<usize> = (0..search.tracks.len())
        .filter(|i| motion.speed(*i) > 0.0)
        .collect();
    let of_pair = |tracks: &[Track], pair: usize| Look {
        due: tracks[pair].due.max(start),
        pair,
    };
    let mut looks: BinaryHeap<Look> = moving.iter().map(|i| of_pair(search.tracks, *i)).collect();
    while let Some(look) = looks.pop().filter(|look| look.due < search.touch.s) {
        search.look_at(look.pair, look.due)?;
        looks.push(of_pair(search.tracks, look.pair));
    }
    // Who may have met between two looks is looked at where the others stop.
    let is_open = |search: &Search<'_, _>, i: usize| {
        !search.tracks[i].is_apart_at(search.touch.s, motion.closing_speed(i))
    };
    while let Some(&i) = moving.iter().find(|i| is_open(&search, **i)) {
        search.look_at(i, search.touch.s)?;
    }
    Ok(search.touch)
}

struct Search<'a, M> {
    motion: &'a M,
    tracks: &'a mut [Track],
    start: f64,
    /// The first touch so far.
    touch: Touch,
}

impl<M: Motion> Search<'_, M> {
    /// Looks at one pair, and works out what follows.
    fn look_at(&mut self, i: usize, s: f64) -> Result<(), usize> {
        let track = &mut self.tracks[i];
        let gap = self.motion.look(i, s);
        let (mut at, mut at_gap) = (s, Some(gap));
        if gap <= CLEARANCE {
            if s <= self.start {
                return Err(i);
            }
            let free = if track.seen < s {
                (track.seen, track.gap)
            } else {
                (self.start, 0.0)
            };
            (at, at_gap) = last_free(self.motion, i, free, (s, gap));
        } else if gap > TOUCH || track.grazing {
            track.grazing &= gap <= TOUCH;
            let sure_step = (gap - TOUCH / 2.0) / self.motion.closing_speed(i).max(SLOWEST);
            let step = sure_step.max(self.motion.least_step(i) / self.motion.speed(i));
            (track.seen, track.gap, track.due) = (s, gap, rounded(s, step));
            return Ok(());
        }
        let pressed = gap <= CLEARANCE && track.grazing;
        self.touch = Touch {
            s: at,
            pair: Some(i),
            pressed,
            gap: at_gap,
        };
        *track = Track {
            grazing: pressed,
            ..Track::unknown_at(at)
        };
        Ok(())
    }
}

/// Between `free` (apart) and `overlapping`, each with its gap: a parameter at which the gap is within the touching range,
/// and the gap there if it was looked at.
///
/// The place where a straight line between the two gaps says that they touch, and the middle, in turns.
fn last_free(
    motion: &impl Motion,
    i: usize,
    free: (f64, f64),
    overlapping: (f64, f64),
) -> (f64, Option<f64>) {
    let ((mut low, mut low_gap), (mut high, mut high_gap)) = (free, overlapping);
    let mut seen = None;
    for turn in 0..60 {
        let share = (low_gap - TOUCH / 2.0) / (low_gap - high_gap);
        let by_line = low + (high - low) * share;
        let is_within = turn % 2 == 0 && share.is_finite() && by_line > low && by_line < high;
        let at = if is_within {
            by_line
        } else {
            f64::midpoint(low, high)
        };
        if at <= low || at >= high {
            break;
        }
        let gap = motion.gap(i, at, NEAR);
        if gap <= CLEARANCE {
            (high, high_gap) = (at, gap);
        } else {
            (low, low_gap) = (at, gap);
            seen = Some(gap);
            if gap <= TOUCH {
                break;
            }
        }
    }
    (low, seen)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Balls on a line that start at `from` and move towards a wall at 0 with their own speeds.
    struct Line {
        from: Vec<f64>,
        speeds: Vec<f64>,
    }

    impl Motion for Line {
        fn gap(&self, i: usize, s: f64, cutoff: f64) -> f64 {
            (self.from[i] - s * self.speeds[i]).min(cutoff)
        }
        fn look(&self, i: usize, s: f64) -> f64 {
            let gap = self.gap(i, s, 1.0);
            if gap * 0.9 > NEAR { gap * 0.9 } else { gap }
        }
        fn least_step(&self, _: usize) -> f64 {
            5e-4
        }
        fn speed(&self, i: usize) -> f64 {
            self.speeds[i] * 1.7
        }
        fn closing_speed(&self, i: usize) -> f64 {
            self.speeds[i] * 1.2
        }
    }

    #[test]
    fn the_first_of_several_balls_to_reach_the_wall_is_found_just_before_it_does() {
        let line = Line {
            from: vec![0.3, 0.2, 0.5, 0.1],
            speeds: vec![1.0, 1.0, 3.0, 0.0],
        };
        let mut tracks = [Track::unknown_at(0.0); 4];
        let touch = first_touch(&line, &mut tracks, 0.0, 10.0).unwrap();
        assert_eq!(touch.pair, Some(2));
        let gap = 0.5 - 3.0 * touch.s;
        assert!(gap > CLEARANCE && gap <= TOUCH, "{gap}");
    }

    #[test]
    fn the_end_comes_first_when_nothing_gets_there() {
        let line = Line {
            from: vec![0.3],
            speeds: vec![1.0],
        };
        let touch = first_touch(&line, &mut [Track::unknown_at(0.0)], 0.0, 0.2).unwrap();
        assert_eq!(
            touch,
            Touch {
                s: 0.2,
                pair: None,
                pressed: false,
                gap: None
            }
        );
    }

    #[test]
    fn a_body_that_starts_inside_is_named() {
        let line = Line {
            from: vec![0.3, -0.1],
            speeds: vec![1.0, 1.0],
        };
        assert_eq!(
            first_touch(&line, &mut [Track::unknown_at(0.0); 2], 0.0, 1.0),
            Err(1)
        );
    }

    #[test]
    fn a_grazing_body_stops_only_where_it_would_overlap() {
        let line = Line {
            from: vec![9e-5],
            speeds: vec![1.0],
        };
        let mut tracks = [Track {
            grazing: true,
            ..Track::unknown_at(0.0)
        }];
        let touch = first_touch(&line, &mut tracks, 0.0, 1.0).unwrap();
        assert!(touch.pressed && touch.pair == Some(0));
        let gap = 9e-5 - touch.s;
        assert!(gap > CLEARANCE && gap <= TOUCH);
    }
}
