//! When do moving bodies first touch?

/// Two bodies touch where their gap is at most this, metres. Nothing ever ends closer than [`CLEARANCE`].
pub(crate) const TOUCH: f64 = 1e-4;
/// A smaller gap counts as an overlap, so that rounding in a distance cannot hide one; metres.
pub(crate) const CLEARANCE: f64 = 1e-6;
/// A gap larger than this need not be known exactly to choose the next step, metres.
pub(crate) const NEAR: f64 = 2.5e-3;

/// A search goes on in this many slices of s.
const N_SLICES: u32 = 12;

/// Gaps between pairs of bodies that move with one parameter s.
pub(crate) trait Motion {
    /// The gap of pair `i` at `s`, metres: 0 or less where the two overlap, `cutoff` where it is that or more.
    fn gap(&self, i: usize, s: f64, cutoff: f64) -> f64;
    /// The same, or any lower bound of it above [`NEAR`].
    fn look(&self, i: usize, s: f64) -> f64;
    /// A bound of how fast the gap of pair `i` can change, metres per unit of s; 0 where it does not move.
    fn speed(&self, i: usize) -> f64;
    /// Where the gap is small, the pair moves this far between two looks, metres: less than the bodies are thick, so
    /// that none can be hopped over.
    fn least_step(&self, i: usize) -> f64;
}

/// What is known of one pair.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Track {
    /// The pair was seen apart here.
    free: f64,
    /// The next look is due here.
    due: f64,
    /// Nothing can happen before `due`; else the pair may have met since `free`.
    sure: bool,
    /// The pair touches, and may go on moving as long as it does not overlap.
    pub(crate) grazing: bool,
}

impl Track {
    /// Whether the pair must be looked at to know what happens before `horizon`, where `touch` is the first touch so far.
    fn is_open(&self, horizon: f64, touch: f64) -> bool {
        self.due < horizon.min(touch) || (touch <= horizon && !self.sure && self.free < touch)
    }

    /// Nothing is known but that the pair is apart at `s`.
    pub(crate) fn apart_at(s: f64) -> Self {
        Self {
            free: s,
            due: s,
            sure: true,
            grazing: false,
        }
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
}

/// The least s up to `end` at which a pair's gap is in ([`CLEARANCE`], [`TOUCH`]]; pairs that graze must want to overlap.
///
/// Conservative advancement: each pair is looked at again only when it could have used up its last known gap. Near the
/// object, where such steps would get ever smaller, pairs move at least their least step and an overlap is bisected.
///
/// `Err` names a pair that overlaps at the start.
pub(crate) fn first_touch(motion: &impl Motion, tracks: &mut [Track], end: f64) -> Result<Touch, usize> {
    let mut touch = Touch {
        s: end,
        pair: None,
        pressed: false,
    };
    let moving: Vec<usize> = (0..tracks.len()).filter(|i| motion.speed(*i) > 0.0).collect();
    let start = moving.iter().map(|i| tracks[*i].free).fold(end, f64::min);
    // In slices, so that no pair is followed far beyond what turns out to be the first touch.
    for slice in 1..=N_SLICES {
        let last = slice == N_SLICES;
        let horizon = if last {
            end
        } else {
            start + (end - start) * f64::from(slice) / f64::from(N_SLICES)
        };
        let mut settled = false;
        while !settled {
            settled = true;
            for &i in &moving {
                while tracks[i].is_open(horizon, touch.s) {
                    settled = false;
                    look_at(motion, i, &mut tracks[i], &mut touch)?;
                }
            }
        }
        if touch.s <= horizon {
            break;
        }
    }
    Ok(touch)
}

/// Looks at one pair where it is due, and works out what follows.
fn look_at(motion: &impl Motion, i: usize, track: &mut Track, touch: &mut Touch) -> Result<(), usize> {
    let s = track.due.min(touch.s);
    let gap = motion.look(i, s);
    if gap <= CLEARANCE {
        if track.free >= s {
            return Err(i);
        }
        let pressed = track.grazing;
        let at = last_free(motion, i, track.free, s);
        *touch = Touch {
            s: at,
            pair: Some(i),
            pressed,
        };
        *track = Track {
            free: at,
            due: at,
            sure: true,
            grazing: pressed,
        };
    } else if gap <= TOUCH && !track.grazing {
        *touch = Touch {
            s,
            pair: Some(i),
            pressed: false,
        };
        *track = Track {
            free: s,
            due: s,
            sure: true,
            grazing: false,
        };
    } else {
        track.grazing &= gap <= TOUCH;
        let (sure_step, least_step) = (gap - TOUCH / 2.0, motion.least_step(i));
        track.free = s;
        track.sure = sure_step >= least_step;
        track.due = s + sure_step.max(least_step) / motion.speed(i);
    }
    Ok(())
}

/// Between `free` (apart) and `overlapping`: a parameter at which the gap is within the touching range.
fn last_free(motion: &impl Motion, i: usize, free: f64, overlapping: f64) -> f64 {
    let (mut low, mut high) = (free, overlapping);
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            break;
        }
        let gap = motion.gap(i, middle, NEAR);
        if gap <= CLEARANCE {
            high = middle;
        } else {
            low = middle;
            if gap <= TOUCH {
                break;
            }
        }
    }
    low
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
    }

    #[test]
    fn the_first_of_several_balls_to_reach_the_wall_is_found_just_before_it_does() {
        let line = Line {
            from: vec![0.3, 0.2, 0.5, 0.1],
            speeds: vec![1.0, 1.0, 3.0, 0.0],
        };
        let mut tracks = [Track::apart_at(0.0); 4];
        let touch = first_touch(&line, &mut tracks, 10.0).unwrap();
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
        let touch = first_touch(&line, &mut [Track::apart_at(0.0)], 0.2).unwrap();
        assert_eq!(
            touch,
            Touch {
                s: 0.2,
                pair: None,
                pressed: false
            }
        );
    }

    #[test]
    fn a_body_that_starts_inside_is_named() {
        let line = Line {
            from: vec![0.3, -0.1],
            speeds: vec![1.0, 1.0],
        };
        assert_eq!(first_touch(&line, &mut [Track::apart_at(0.0); 2], 1.0), Err(1));
    }

    #[test]
    fn a_grazing_body_stops_only_where_it_would_overlap() {
        let line = Line {
            from: vec![9e-5],
            speeds: vec![1.0],
        };
        let mut tracks = [Track {
            grazing: true,
            ..Track::apart_at(0.0)
        }];
        let touch = first_touch(&line, &mut tracks, 1.0).unwrap();
        assert!(touch.pressed && touch.pair == Some(0));
        let gap = 9e-5 - touch.s;
        assert!(gap > CLEARANCE && gap <= TOUCH);
    }
}
