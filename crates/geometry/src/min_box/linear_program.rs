//! The least value of a sum of six maxima of linear functions of three variables.

use nalgebra::{SMatrix, SVector, Vector3};

/// One linear function, `value + slope · x`, of the maximum that `side` names.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub(super) side: usize,
    pub(super) value: f64,
    pub(super) slope: Vector3<f64>,
}

const N_SIDES: usize = 6;
const N_ROWS: usize = N_SIDES + 3;

/// Exchanges after which the point reached has to do.
const MAX_EXCHANGES: usize = 60;

/// A piece above its side's maximum by less than this share of what the pieces vary by counts as below.
const ROUNDING: f64 = 1e-12;

/// Entries of the entering column below this (basic columns have entries near 1) cannot be exchanged for.
const PIVOT_ROUNDING: f64 = 1e-11;

/// Where |xⱼ| ≤ `reach` makes Σₛ maxᵢ (valueᵢ + slopeᵢ · x) least, and that least value.
///
/// `pieces[s]` is a piece of side `s` for the first six `s`; these are where the method starts. It is the revised
/// simplex method on the dual, where the six first pieces and a bound for each variable are feasible at once:
///
/// ```text
/// max Σ λᵢ valueᵢ − reach Σ μⱼ    with  Σ_{i of s} λᵢ = 1,  −Σ λᵢ slopeᵢ + Σ ±μⱼ eⱼ = 0,  λ, μ ≥ 0
/// ```
pub(super) fn least_sum_of_maxima(pieces: &[Piece], reach: f64) -> (Vector3<f64>, f64) {
    let total: Vector3<f64> = pieces[..N_SIDES].iter().map(|p| p.slope).sum();
    let signs = total.map(|t| if t < 0.0 { -1.0 } else { 1.0 });
    // Basis columns: the six first pieces, then a bound of each variable. Its inverse, and the basic solution.
    let mut inverse = SMatrix::<f64, N_ROWS, N_ROWS>::identity();
    let mut solution = SVector::<f64, N_ROWS>::repeat(1.0);
    let mut multipliers = SVector::<f64, N_ROWS>::zeros();
    for j in 0..3 {
        let row = N_SIDES + j;
        inverse[(row, row)] = signs[j];
        solution[row] = total[j].abs();
        multipliers[row] = -reach * signs[j];
        for s in 0..N_SIDES {
            inverse[(row, s)] = signs[j] * pieces[s].slope[j];
        }
    }
    for s in 0..N_SIDES {
        multipliers[s] = pieces[s].value + pieces[s].slope.dot(&multipliers.fixed_rows::<3>(N_SIDES));
    }
    let steepest = pieces.iter().map(|p| p.slope.amax()).fold(0.0, f64::max);
    let rounding = ROUNDING * reach * steepest;

    for _ in 0..MAX_EXCHANGES {
        let x = Vector3::new(multipliers[6], multipliers[7], multipliers[8]);
        // The piece or bound that the point reached violates most enters the basis.
        let mut most = rounding;
        let mut entering: Option<(usize, Vector3<f64>, f64)> = None;
        for piece in pieces {
            let excess = piece.value + piece.slope.dot(&x) - multipliers[piece.side];
            if excess > most {
                most = excess;
                entering = Some((piece.side, piece.slope, excess));
            }
        }
        for j in 0..3 {
            let excess = x[j].abs() - reach;
            if excess * steepest > most {
                most = excess * steepest;
                entering = Some((N_ROWS, Vector3::ith(j, x[j].signum()), excess));
            }
        }
        let Some((side, slope, excess)) = entering else {
            break;
        };
        let mut column = -(inverse.fixed_columns::<3>(N_SIDES) * slope);
        if side < N_SIDES {
            column += inverse.column(side);
        }
        let mut leaving: Option<(usize, f64)> = None;
        for i in 0..N_ROWS {
            if column[i] > PIVOT_ROUNDING {
                let ratio = solution[i].max(0.0) / column[i];
                if leaving.is_none_or(|(_, least)| ratio < least) {
                    leaving = Some((i, ratio));
                }
            }
        }
        let Some((row, step)) = leaving else { break };
        solution -= column * step;
        solution[row] = step;
        let pivot = inverse.row(row) / column[row];
        inverse -= column * pivot;
        inverse.set_row(row, &pivot);
        multipliers += pivot.transpose() * excess;
    }
    let x = Vector3::new(multipliers[6], multipliers[7], multipliers[8]).map(|x| x.clamp(-reach, reach));
    let mut maxima = [f64::NEG_INFINITY; N_SIDES];
    for piece in pieces {
        let value = piece.value + piece.slope.dot(&x);
        maxima[piece.side] = maxima[piece.side].max(value);
    }
    (x, maxima.iter().sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pieces(more: &[(usize, f64, [f64; 3])]) -> Vec<Piece> {
        let flat = (0..N_SIDES).map(|side| (side, 0.0, [0.0; 3]));
        flat.chain(more.iter().copied())
            .map(|(side, value, slope)| Piece {
                side,
                value,
                slope: slope.into(),
            })
            .collect()
    }

    #[test]
    fn a_single_slope_leads_to_the_bounds() {
        let mut sloping = pieces(&[]);
        sloping[2].slope = Vector3::new(1.0, -2.0, 0.5);
        let (x, least) = least_sum_of_maxima(&sloping, 0.1);
        assert_eq!(x, Vector3::new(-0.1, 0.1, -0.1));
        assert!((least + 0.35).abs() < 1e-15);
    }

    #[test]
    fn opposed_pieces_meet_where_they_are_equal() {
        let mut sloping = pieces(&[(0, -0.3, [-1.0, 0.0, 0.0]), (3, -0.1, [0.0, -2.0, 0.0])]);
        sloping[0].slope = Vector3::new(2.0, 0.0, 0.0);
        sloping[3].slope = Vector3::new(0.0, 0.5, 1.0);
        // max(2x, −0.3 − x) is least at x = −0.1; max(y/2 + z, −0.1 − 2y) has z at its bound and y where both agree.
        let (x, least) = least_sum_of_maxima(&sloping, 1.0);
        assert!((x - Vector3::new(-0.1, 0.36, -1.0)).amax() < 1e-12, "{x}");
        assert!((least - (-0.2 - 0.82)).abs() < 1e-12, "{least}");
    }

    #[test]
    fn the_least_value_is_below_that_of_many_other_points() {
        use rand::{RngExt, SeedableRng};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        for _ in 0..200 {
            let more: Vec<_> = (0..rng.random_range(6..60))
                .map(|i| {
                    let slope = [(); 3].map(|()| rng.random_range(-1.0..1.0));
                    (i % N_SIDES, rng.random_range(-0.1..0.0), slope)
                })
                .collect();
            let mut all = pieces(&more);
            for piece in &mut all[..N_SIDES] {
                piece.slope = Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
            }
            let value_at = |x: &Vector3<f64>| -> f64 {
                let of_side = |side| {
                    let on_side = all.iter().filter(move |p| p.side == side);
                    on_side
                        .map(|p| p.value + p.slope.dot(x))
                        .fold(f64::NEG_INFINITY, f64::max)
                };
                (0..N_SIDES).map(of_side).sum()
            };
            let (x, least) = least_sum_of_maxima(&all, 0.3);
            assert!((value_at(&x) - least).abs() < 1e-12);
            for scale in [0.3, 1e-2, 1e-4] {
                for _ in 0..50 {
                    let other = x + Vector3::from_fn(|_, _| scale * rng.random_range(-1.0..1.0));
                    let other = other.map(|x| x.clamp(-0.3, 0.3));
                    assert!(value_at(&other) > least - 1e-12);
                }
            }
        }
    }
}
