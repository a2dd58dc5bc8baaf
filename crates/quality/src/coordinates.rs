//! Which wrenches count, and how much.

use nalgebra::{Matrix6, Vector6};

use crate::{QualityError, Wrench};

/// Which of the six coordinates of a wrench count; at least two. The others are left out, as if nothing pushed there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WrenchAxes([bool; 6]);

impl WrenchAxes {
    /// All six, the default.
    pub const ALL: Self = Self([true; 6]);
    /// Forces only.
    pub const FORCES: Self = Self([true, true, true, false, false, false]);
    /// Torques only.
    pub const TORQUES: Self = Self([false, false, false, true, true, true]);
    /// A flat object in the plane z = 0: fx, fy and τz.
    pub const PLANAR: Self = Self([true, true, false, false, false, true]);

    /// The axes marked true, in the order `[fx fy fz τx τy τz]`.
    ///
    /// # Errors
    ///
    /// [`QualityError::TooFewAxes`] with fewer than two.
    pub fn new(counts: [bool; 6]) -> Result<Self, QualityError> {
        let found = counts.iter().filter(|&&c| c).count();
        if found < 2 {
            return Err(QualityError::TooFewAxes { found });
        }
        Ok(Self(counts))
    }

    /// How many axes count, 2 to 6.
    pub fn count(&self) -> usize {
        self.0.iter().filter(|&&c| c).count()
    }
}

impl Default for WrenchAxes {
    fn default() -> Self {
        Self::ALL
    }
}

/// What a wrench weighs: ‖w‖² = wᵀ M w, with M symmetric and positive definite.
///
/// ε is then the largest s for which the ellipsoid {w : wᵀ M w ≤ s²} lies in the wrench space. The identity, used where
/// no metric is given, counts a unit of force and a unit of (scaled) torque alike. Give a direction that a task pushes
/// along a small weight, and it must be resisted far out. With [`WrenchAxes`] the rows and columns that count are taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WrenchMetric(Matrix6<f64>);

impl WrenchMetric {
    /// The metric of the matrix M.
    ///
    /// # Errors
    ///
    /// [`QualityError::BadMetric`] unless M is finite, symmetric to 1e-12 of its largest entry, and positive definite.
    pub fn new(matrix: Matrix6<f64>) -> Result<Self, QualityError> {
        let symmetric = (matrix - matrix.transpose()).amax() <= 1e-12 * matrix.amax();
        if !(matrix.iter().all(|c| c.is_finite()) && symmetric && matrix.cholesky().is_some()) {
            return Err(QualityError::BadMetric);
        }
        Ok(Self(matrix))
    }

    /// The ellipsoid with these semi-axes along `[fx fy fz τx τy τz]`: M = diag(1 / aₖ²).
    ///
    /// # Errors
    ///
    /// [`QualityError::BadMetric`] unless every semi-axis is positive and finite.
    pub fn from_semi_axes(semi_axes: [f64; 6]) -> Result<Self, QualityError> {
        Self::new(Matrix6::from_diagonal(&Vector6::from(
            semi_axes.map(|a| 1.0 / (a * a)),
        )))
    }
}

/// The map from wrenches to the coordinates in which ε is the radius of a round ball: Lᵀ w over the axes that count,
/// M = L Lᵀ. Coordinates that are not used are 0.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Coordinates {
    axes: [usize; 6],
    n_axes: usize,
    lower: Option<Matrix6<f64>>,
}

impl Coordinates {
    pub(crate) fn new(axes: WrenchAxes, metric: Option<&WrenchMetric>) -> Result<Self, QualityError> {
        let mut order = [0; 6];
        let mut n_axes = 0;
        for (k, _) in axes.0.iter().enumerate().filter(|(_, counts)| **counts) {
            order[n_axes] = k;
            n_axes += 1;
        }
        let lower = match metric {
            None => None,
            Some(WrenchMetric(m)) => {
                let block = Matrix6::from_fn(|r, c| {
                    if r < n_axes && c < n_axes {
                        m[(order[r], order[c])]
                    } else {
                        f64::from(u8::from(r == c))
                    }
                });
                Some(block.cholesky().ok_or(QualityError::BadMetric)?.l())
            }
        };
        Ok(Self {
            axes: order,
            n_axes,
            lower,
        })
    }

    pub(crate) fn n_axes(&self) -> usize {
        self.n_axes
    }

    /// The axes that count, as places in a wrench.
    pub(crate) fn axes(&self) -> &[usize] {
        &self.axes[..self.n_axes]
    }

    fn picked(&self, wrench: &Wrench) -> Vector6<f64> {
        let mut picked = Vector6::zeros();
        for i in 0..self.n_axes {
            picked[i] = wrench[self.axes[i]];
        }
        picked
    }

    fn spread(&self, picked: &Vector6<f64>) -> Wrench {
        let mut wrench = Wrench::zeros();
        for i in 0..self.n_axes {
            wrench[self.axes[i]] = picked[i];
        }
        wrench
    }

    /// Coordinates of a wrench.
    pub(crate) fn of(&self, wrench: &Wrench) -> [f64; 6] {
        let picked = if self.n_axes == 6 {
            *wrench
        } else {
            self.picked(wrench)
        };
        match &self.lower {
            None => picked.into(),
            Some(lower) => lower.tr_mul(&picked).into(),
        }
    }

    /// The direction e with e · coordinates = d · wrench.
    pub(crate) fn of_direction(&self, direction: &Wrench) -> [f64; 6] {
        let picked = self.picked(direction);
        match &self.lower {
            None => picked.into(),
            Some(lower) => lower.solve_lower_triangular(&picked).unwrap_or(picked).into(),
        }
    }

    /// The wrench that has these coordinates; 0 along axes that do not count.
    pub(crate) fn wrench(&self, coordinates: &[f64; 6]) -> Wrench {
        let c = Vector6::from(*coordinates);
        match &self.lower {
            None => self.spread(&c),
            Some(lower) => self.spread(&lower.tr_solve_lower_triangular(&c).unwrap_or(c)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_go_back_to_the_wrench_and_keep_the_norm() {
        let tilt = Matrix6::from_fn(|r, c| {
            if r == c {
                2.0 + r as f64
            } else {
                0.3 / (1.0 + (r + c) as f64)
            }
        });
        let metric = WrenchMetric::new(tilt).unwrap();
        let w = Wrench::new(0.3, -1.0, 0.5, 2.0, 0.1, -0.7);
        let coordinates = Coordinates::new(WrenchAxes::ALL, Some(&metric)).unwrap();
        let c = coordinates.of(&w);
        assert!((coordinates.wrench(&c) - w).amax() < 1e-14);
        let norm: f64 = c.iter().map(|x| x * x).sum();
        assert!((norm - w.dot(&(tilt * w))).abs() < 1e-13);
        let d = Wrench::new(1.0, 0.0, -2.0, 0.5, 0.5, 3.0);
        let e = coordinates.of_direction(&d);
        let both: f64 = e.iter().zip(&c).map(|(a, b)| a * b).sum();
        assert!((both - d.dot(&w)).abs() < 1e-13);
    }

    #[test]
    fn a_mask_keeps_its_axes_in_order() {
        let coordinates = Coordinates::new(WrenchAxes::PLANAR, None).unwrap();
        let c = coordinates.of(&Wrench::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0));
        assert_eq!(c, [1.0, 2.0, 6.0, 0.0, 0.0, 0.0]);
        assert_eq!(coordinates.wrench(&c), Wrench::new(1.0, 2.0, 0.0, 0.0, 0.0, 6.0));
    }

    #[test]
    fn masks_and_metrics_out_of_range_are_errors() {
        let one = WrenchAxes::new([true, false, false, false, false, false]);
        assert_eq!(
            one.unwrap_err().to_string(),
            "1 of the wrench's six coordinates counts; expected 2 to 6"
        );
        assert_eq!(
            WrenchMetric::new(-Matrix6::identity()),
            Err(QualityError::BadMetric)
        );
        assert_eq!(
            WrenchMetric::from_semi_axes([1.0, 1.0, 1.0, 0.0, 1.0, 1.0]),
            Err(QualityError::BadMetric)
        );
        assert_eq!(
            WrenchMetric::new(Matrix6::from_element(f64::NAN)),
            Err(QualityError::BadMetric)
        );
    }
}
