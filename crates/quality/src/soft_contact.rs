//! How much torsion a soft contact carries.

/// Torsion length e (m) of a rubber contact where the two surfaces have the relative radii of curvature `r1`, `r2` (m).
///
/// ```text
/// δ = √(N h / (E π √(r1 r2)))      a = √(2 δ r1)      b = √(2 δ r2)      e = 8 √(a b) / 15
/// ```
///
/// is the mattress (Winkler) model: a layer of depth h = 3 mm and modulus E = 1.5 MPa pressed with N = 5 N touches over
/// an ellipse with semi-axes a, b. A radius that is not positive and finite (a flat or a saddle-shaped pair) counts as
/// [`DEGENERATE_RADIUS`]; two such give 2.13 mm ([`soft_torsion_default`]). The result is positive and finite.
///
/// Source: Johnson, Contact Mechanics (1985), sections 4.1 and 4.3; the values are GraspIt!'s.
pub fn soft_torsion(r1: f64, r2: f64) -> f64 {
    let usable = |r: f64| {
        if r.is_finite() && r > 0.0 {
            r
        } else {
            DEGENERATE_RADIUS
        }
    };
    let (r1, r2) = (usable(r1), usable(r2));
    // √r1 √r2 rather than √(r1 r2), whose product may leave the range of f64.
    let mean_radius = r1.sqrt() * r2.sqrt();
    let depth = (NORMAL_FORCE * LAYER_DEPTH / (YOUNGS_MODULUS * std::f64::consts::PI * mean_radius)).sqrt();
    let a = (2.0 * depth * r1).sqrt();
    let b = (2.0 * depth * r2).sqrt();
    8.0 * (a * b).sqrt() / 15.0
}

/// [`soft_torsion`] where nothing is known of the curvatures, 2.13 mm.
pub fn soft_torsion_default() -> f64 {
    soft_torsion(DEGENERATE_RADIUS, DEGENERATE_RADIUS)
}

/// Radius (m) that stands in for one that cannot be told.
pub const DEGENERATE_RADIUS: f64 = 0.020;
/// Pressing force, N.
const NORMAL_FORCE: f64 = 5.0;
/// Depth of the soft layer, m.
const LAYER_DEPTH: f64 = 0.003;
/// Young's modulus of the soft layer, Pa.
const YOUNGS_MODULUS: f64 = 1.5e6;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_radii_of_20_mm_give_2_13_mm() {
        // By hand: δ = 0.3989 mm, a = b = 3.995 mm, e = 8 · 3.995 / 15.
        assert!(
            (soft_torsion_default() - 2.1306e-3).abs() < 1e-7,
            "{}",
            soft_torsion_default()
        );
    }

    #[test]
    fn degenerate_radii_count_as_20_mm() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(soft_torsion(bad, 0.02), soft_torsion_default());
        }
        assert!(soft_torsion(1e300, 1e300).is_finite());
    }

    #[test]
    fn flatter_pairs_carry_more_torsion() {
        assert!(soft_torsion(0.03, 0.02) > soft_torsion(0.02, 0.02));
        assert_eq!(soft_torsion(0.03, 0.02), soft_torsion(0.02, 0.03));
    }
}
