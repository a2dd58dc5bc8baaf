//! Directions spread evenly over the sphere, with weights to integrate by and a way to look between them.

use std::collections::BTreeMap;

use nalgebra::{UnitVector3, Vector3};

/// The vertices of an icosahedron whose faces were split into four `level` times, with their shares of the sphere.
#[derive(Debug, Clone, PartialEq)]
pub struct Icosphere {
    directions: Vec<UnitVector3<f64>>,
    weights: Vec<f64>,
    /// Faces of every level, the children of face `f` being `4 f … 4 f + 3` of the next.
    levels: Vec<Vec<Face>>,
}

/// A face's directions a, b, c, and b × c, c × a, a × b.
#[derive(Debug, Clone, PartialEq)]
struct Face {
    corners: [u32; 3],
    sides: [Vector3<f64>; 3],
}

impl Face {
    fn new(corners: [u32; 3], directions: &[UnitVector3<f64>]) -> Self {
        let [a, b, c] = corners.map(|v| directions[v as usize].as_ref());
        Self {
            corners,
            sides: [b.cross(c), c.cross(a), a.cross(b)],
        }
    }
}

impl Icosphere {
    /// 10 · 4^level + 2 directions; level 4 has 2,562. `level` is at most 7 (163,842); more counts as 7.
    pub fn new(level: usize) -> Self {
        let (mut points, faces) = icosahedron();
        let mut levels = vec![faces];
        for _ in 0..level.min(7) {
            let mut middles = BTreeMap::new();
            let mut middle = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    points.push((points[a as usize] + points[b as usize]).normalize());
                    points.len() as u32 - 1
                })
            };
            let split = |&[a, b, c]: &[u32; 3]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            };
            let next = levels.last().into_iter().flatten().flat_map(split).collect();
            levels.push(next);
        }
        let mut weights = vec![0.0; points.len()];
        for face in levels.last().into_iter().flatten() {
            let third = solid_angle(face.map(|v| points[v as usize])) / 3.0;
            for v in face {
                weights[*v as usize] += third;
            }
        }
        let directions: Vec<_> = points.into_iter().map(UnitVector3::new_unchecked).collect();
        let faces = |level: Vec<[u32; 3]>| level.into_iter().map(|f| Face::new(f, &directions)).collect();
        Self {
            levels: levels.into_iter().map(faces).collect(),
            directions,
            weights,
        }
    }

    /// The directions.
    pub fn directions(&self) -> &[UnitVector3<f64>] {
        &self.directions
    }

    /// Solid angle (steradian) that each direction stands for; they add up to 4π.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// `∫ f dω` from the values of f at the directions.
    pub fn integral(&self, values: &[f64]) -> f64 {
        self.weights.iter().zip(values).map(|(w, v)| w * v).sum()
    }

    /// Densities that integrate to 1 from unnormalised logarithms of densities; the uniform density where none is
    /// finite.
    pub fn normalized(&self, log_densities: &[f64]) -> Vec<f64> {
        let finite = |l: &f64| if l.is_nan() { f64::NEG_INFINITY } else { *l };
        let top = log_densities.iter().map(finite).fold(f64::NEG_INFINITY, f64::max);
        if !top.is_finite() {
            return vec![0.25 / std::f64::consts::PI; log_densities.len()];
        }
        let shifted: Vec<f64> = log_densities.iter().map(|l| (finite(l) - top).exp()).collect();
        let integral = self.integral(&shifted);
        shifted.into_iter().map(|d| d / integral).collect()
    }

    /// The face that a direction passes through: its three directions and their weights, which add up to 1.
    pub fn locate(&self, direction: &Vector3<f64>) -> [(usize, f64); 3] {
        // Coordinates of the direction in the cone of a face; the least is ≥ 0 inside.
        let coordinates = |face: &Face| {
            let w = face.sides.map(|side| direction.dot(&side));
            (w, w[0].min(w[1]).min(w[2]))
        };
        let mut candidates = 0..20;
        let mut inside = ([1.0, 0.0, 0.0], [0; 3]);
        for faces in &self.levels {
            let mut best = (f64::NEG_INFINITY, 0);
            for f in candidates {
                let (w, least) = coordinates(&faces[f]);
                if least > best.0 {
                    best = (least, f);
                    inside = (w, faces[f].corners);
                }
            }
            candidates = 4 * best.1..4 * best.1 + 4;
        }
        let (w, face) = inside;
        let sum: f64 = w.iter().sum();
        std::array::from_fn(|k| (face[k] as usize, w[k] / sum))
    }

    /// Value between the directions: linear over the face that the direction passes through. `values` has one entry a
    /// direction.
    pub fn interpolate(&self, values: &[f64], direction: &Vector3<f64>) -> f64 {
        self.locate(direction)
            .iter()
            .map(|(v, weight)| weight * values[*v])
            .sum()
    }
}

/// Solid angle of the triangle of three unit vectors (Van Oosterom and Strackee 1983).
fn solid_angle([a, b, c]: [Vector3<f64>; 3]) -> f64 {
    let volume = a.dot(&b.cross(&c)).abs();
    2.0 * volume.atan2(1.0 + a.dot(&b) + b.dot(&c) + c.dot(&a))
}

fn icosahedron() -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
    let golden = f64::midpoint(1.0, 5.0_f64.sqrt());
    let mut points = Vec::new();
    for (s, t) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        points.extend([
            Vector3::new(0.0, s, t),
            Vector3::new(s, t, 0.0),
            Vector3::new(t, 0.0, s),
        ]);
    }
    // Edges have length 2; three vertices that are all 2 apart make a face, turned outward.
    let near = |a: usize, b: usize| (points[a] - points[b]).norm() < 2.1;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = points[a].dot(&points[b].cross(&points[c])) > 0.0;
                    let [b, c] = if outward { [b, c] } else { [c, b] };
                    faces.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    (points.into_iter().map(|p| p.normalize()).collect(), faces)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn level_four_has_2562_directions_that_share_the_whole_sphere() {
        let sphere = Icosphere::new(4);
        assert_eq!(sphere.directions().len(), 2562);
        assert_eq!(sphere.levels[4].len(), 20 * 256);
        assert!((sphere.weights().iter().sum::<f64>() - 4.0 * PI).abs() < 1e-11);
        let (least, most) = sphere
            .weights()
            .iter()
            .fold((9.0_f64, 0.0_f64), |(l, m), w| (l.min(*w), m.max(*w)));
        assert!(most / least < 2.1, "{least} {most}");
        assert!(sphere.directions().iter().all(|d| (d.norm() - 1.0).abs() < 1e-12));
    }

    #[test]
    fn polynomials_and_a_peaked_density_integrate_to_a_thousandth() {
        let sphere = Icosphere::new(4);
        let of = |f: &dyn Fn(&Vector3<f64>) -> f64| {
            sphere.integral(&sphere.directions().iter().map(|d| f(d)).collect::<Vec<_>>())
        };
        assert!((of(&|d| d.z * d.z) - 4.0 * PI / 3.0).abs() < 1e-3);
        assert!(of(&|d| d.x * d.y + d.z).abs() < 1e-10);
        // Von Mises–Fisher with κ = 20: ∫ exp(κ cos θ) dω = 4π sinh κ / κ, here divided by e^κ.
        let axis = Vector3::new(0.3, -0.5, 0.8).normalize();
        let expected = 2.0 * PI / 20.0 * (1.0 - (-40.0_f64).exp());
        let found = of(&|d| (20.0 * (d.dot(&axis) - 1.0)).exp());
        assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
    }

    #[test]
    fn logarithms_of_any_size_normalise() {
        let sphere = Icosphere::new(2);
        let logs: Vec<f64> = sphere.directions().iter().map(|d| 3.0 * d.x - 9_000.0).collect();
        let density = sphere.normalized(&logs);
        assert!((sphere.integral(&density) - 1.0).abs() < 1e-12);
        let nowhere = sphere.normalized(&vec![f64::NEG_INFINITY; 162]);
        assert!((sphere.integral(&nowhere) - 1.0).abs() < 1e-12);
        let mut holes = logs;
        holes[5] = f64::NAN;
        assert_eq!(sphere.normalized(&holes)[5], 0.0);
    }

    #[test]
    fn looking_between_directions_is_exact_at_them_and_close_elsewhere() {
        let sphere = Icosphere::new(4);
        let f = |d: &Vector3<f64>| 1.0 + d.x + d.y * d.z;
        let values: Vec<f64> = sphere.directions().iter().map(|d| f(d)).collect();
        for (d, v) in sphere.directions().iter().zip(&values) {
            assert!((sphere.interpolate(&values, d) - v).abs() < 1e-9);
        }
        for i in 0..500 {
            let (z, a) = (2.0 * (f64::from(i) + 0.5) / 500.0 - 1.0, f64::from(i) * 2.399_963);
            let r = (1.0 - z * z).sqrt();
            let d = Vector3::new(r * a.cos(), r * a.sin(), z);
            assert!((sphere.interpolate(&values, &d) - f(&d)).abs() < 3e-3, "{d}");
        }
    }
}
