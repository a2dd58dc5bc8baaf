//! Files with a scene: parts, placed once or often, become one mesh.

use nalgebra::{Matrix4, Point3};

use super::text::error;
use crate::{GeometryError, TriMesh};

/// Files may place a part any number of times; more than this many triangles in all are taken for a mistake.
const MOST_TRIANGLES: usize = 20_000_000;

/// What has been placed so far.
pub(super) struct Assembly {
    format: &'static str,
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

impl Assembly {
    pub fn new(format: &'static str) -> Self {
        Self {
            format,
            vertices: Vec::new(),
            triangles: Vec::new(),
        }
    }

    /// Adds a part. A matrix that mirrors turns its triangles round, so that they still look outward.
    pub fn place(&mut self, part: &TriMesh, scene_from_part: &Matrix4<f64>) -> Result<(), GeometryError> {
        if self.triangles.len() + part.n_triangles() > MOST_TRIANGLES
            || self.vertices.len() + part.vertices().len() > u32::MAX as usize
        {
            let found =
                format!("more than {MOST_TRIANGLES} triangles, counting each part as often as it is placed");
            return Err(error(self.format, "the scene".into(), found, "fewer"));
        }
        let first = self.vertices.len() as u32;
        let linear = scene_from_part.fixed_view::<3, 3>(0, 0);
        let shift = scene_from_part.fixed_view::<3, 1>(0, 3);
        self.vertices.extend(
            part.vertices()
                .iter()
                .map(|p| Point3::from(linear * p.coords + shift)),
        );
        let mirrored = linear.determinant() < 0.0;
        self.triangles.extend(part.triangles().iter().map(|t| {
            let [a, b, c] = t.map(|v| v + first);
            if mirrored { [a, c, b] } else { [a, b, c] }
        }));
        Ok(())
    }

    pub fn into_mesh(self) -> Result<TriMesh, GeometryError> {
        TriMesh::new(self.vertices, self.triangles)
    }
}
