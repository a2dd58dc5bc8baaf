//! A depth camera that looks at a mesh.

use nalgebra::{Point3, Unit, Vector3};
use prehend_geometry::{Surface, TriMesh};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::files::Fingerprint;

/// Points of one side of an object, in its frame's orientation (up is +z, front is +x; metres), wherever its origin is.
#[derive(Debug, Clone, PartialEq)]
pub struct PartialCloud {
    /// The points.
    pub points: Vec<Point3<f64>>,
    /// Where the camera stood.
    pub viewpoint: Point3<f64>,
}

/// Where the camera stands, and how well it sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scanner {
    /// Number of viewpoints, spread evenly over the sphere from 10° below the object's middle to straight above.
    pub n_views: usize,
    /// Distance of the camera from the middle of the object (m).
    pub distance: f64,
    /// Distance of neighbouring rays at the object's middle (m).
    pub pitch: f64,
    /// Standard deviation of the depth (m).
    pub noise: f64,
    /// Noise is drawn from this and the object's name.
    pub seed: u64,
}

impl Default for Scanner {
    /// A structured-light camera at arm's length.
    fn default() -> Self {
        Self {
            n_views: 24,
            distance: 0.6,
            pitch: 0.0025,
            noise: 0.0015,
            seed: 1,
        }
    }
}

/// A surface seen at a flatter angle than this gives no depth.
const LEAST_COSINE: f64 = 0.17;

/// Viewpoints start this far below the horizon.
const LOWEST: f64 = -0.17;

impl Scanner {
    /// One cloud for each viewpoint; empty where no ray meets the object.
    pub fn scan(&self, name: &str, mesh: &TriMesh) -> Vec<PartialCloud> {
        let surface = Surface::new(mesh.clone());
        let (low, high) = mesh.axis_aligned_bounds();
        let middle = nalgebra::center(&low, &high);
        let radius = (high - low).norm() / 2.0;
        let key = Fingerprint::of_stage("scan")
            .with(name.as_bytes())
            .with(&self.seed.to_le_bytes())
            .finish();
        let mut rng = ChaCha8Rng::seed_from_u64(u64::from_str_radix(&key, 16).unwrap_or(self.seed));
        (0..self.n_views)
            .map(|i| {
                let viewpoint = middle + self.direction(i) * (self.distance + radius);
                self.look(&surface, viewpoint, middle, radius, &mut rng)
            })
            .collect()
    }

    /// The golden-angle spiral over the visible part of the sphere.
    fn direction(&self, i: usize) -> Vector3<f64> {
        let z = LOWEST + (1.0 - LOWEST) * (i as f64 + 0.5) / self.n_views as f64;
        let turn = i as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * turn.cos(), r * turn.sin(), z)
    }

    fn look(
        &self,
        surface: &Surface,
        viewpoint: Point3<f64>,
        middle: Point3<f64>,
        radius: f64,
        rng: &mut ChaCha8Rng,
    ) -> PartialCloud {
        let forward = Unit::new_normalize(middle - viewpoint);
        let aside = if forward.z.abs() < 0.9 {
            Vector3::z()
        } else {
            Vector3::x()
        };
        let right = Unit::new_normalize(forward.cross(&aside));
        let down = forward.cross(&right);
        let far = (middle - viewpoint).norm();
        let reach = (radius / self.pitch).ceil() as i64;
        let mut points = Vec::new();
        for row in -reach..=reach {
            for column in -reach..=reach {
                let through =
                    middle + right.scale(column as f64 * self.pitch) + down.scale(row as f64 * self.pitch);
                let ray = through - viewpoint;
                let Some(hit) = surface.cast_ray(&viewpoint, &ray, far + 2.0 * radius) else {
                    continue;
                };
                let ray = ray.normalize();
                let flat = surface
                    .face_normal(hit.triangle)
                    .is_none_or(|n| n.dot(&ray).abs() < LEAST_COSINE);
                if flat {
                    continue;
                }
                let error: f64 = StandardNormal.sample(rng);
                points.push(viewpoint + ray * (hit.distance + self.noise * error));
            }
        }
        PartialCloud { points, viewpoint }
    }
}
