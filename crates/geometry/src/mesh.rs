//! Triangle meshes.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::GeometryError;

/// A triangle mesh: vertices (m) and, per triangle, three vertex indices, counter-clockwise seen from outside.
///
/// Every index is in range and every coordinate finite; nothing else is promised. Triangles may be degenerate,
/// wound either way, and leave holes: [`crate::inspect`] tells, [`crate::repair`] mends what is safe to mend.
#[derive(Debug, Clone, PartialEq)]
pub struct TriMesh {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

impl TriMesh {
    /// Builds a mesh after checking its indices and coordinates.
    ///
    /// # Errors
    ///
    /// [`GeometryError::NotFinite`], [`GeometryError::VertexOutOfRange`], and [`GeometryError::Empty`] where there
    /// is no triangle.
    pub fn new(vertices: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Result<Self, GeometryError> {
        if triangles.is_empty() {
            return Err(GeometryError::Empty { what: "triangles" });
        }
        for (vertex, p) in vertices.iter().enumerate() {
            if let Some(&value) = p.coords.iter().find(|c| !c.is_finite()) {
                return Err(GeometryError::NotFinite { vertex, value });
            }
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices.len()) {
                return Err(GeometryError::VertexOutOfRange {
                    triangle,
                    vertex,
                    n_vertices: vertices.len(),
                });
            }
        }
        Ok(Self { vertices, triangles })
    }

    /// The vertices, in metres.
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    /// The triangles, as indices of vertices.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// How many triangles there are; at least one.
    pub fn n_triangles(&self) -> usize {
        self.triangles.len()
    }

    /// The three corners of one triangle.
    ///
    /// # Panics
    ///
    /// Where `triangle_idx` is out of range.
    pub fn triangle(&self, triangle_idx: usize) -> [Point3<f64>; 3] {
        self.triangles[triangle_idx].map(|v| self.vertices[v as usize])
    }

    /// All triangles' corners, in order.
    pub fn corners(&self) -> impl ExactSizeIterator<Item = [Point3<f64>; 3]> + '_ {
        self.triangles
            .iter()
            .map(|t| t.map(|v| self.vertices[v as usize]))
    }

    /// The mesh moved by a rigid motion.
    #[must_use]
    pub fn transformed(&self, motion: &Isometry3<f64>) -> Self {
        Self {
            vertices: self.vertices.iter().map(|p| motion * p).collect(),
            triangles: self.triangles.clone(),
        }
    }

    /// The mesh scaled about the origin.
    ///
    /// # Panics
    ///
    /// Where `factor` is not positive and finite.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        assert!(
            factor.is_finite() && factor > 0.0,
            "a scale must be positive and finite, found {factor}"
        );
        Self {
            vertices: self.vertices.iter().map(|p| p * factor).collect(),
            triangles: self.triangles.clone(),
        }
    }

    /// Lowest and highest coordinates over the vertices that triangles use.
    pub fn axis_aligned_bounds(&self) -> (Point3<f64>, Point3<f64>) {
        let mut low = Vector3::repeat(f64::INFINITY);
        let mut high = Vector3::repeat(f64::NEG_INFINITY);
        for p in self.corners().flatten() {
            low = low.inf(&p.coords);
            high = high.sup(&p.coords);
        }
        (low.into(), high.into())
    }
}
