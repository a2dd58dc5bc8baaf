//! A closed surface woven from rings of vertices that neighbouring strips share.

use nalgebra::Point3;
use std::ops::Range;

/// Indices of the vertices of one closed ring, counter-clockwise about the direction in which the surface travels.
pub type Ring = Vec<usize>;

/// What a triangle belongs to; parts differ in density and in what a tutor thinks of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// What the object is made of where nothing else is said.
    Body,
    /// What a person holds.
    Handle,
    /// Blade, hammer head, or screwdriver shaft.
    Functional,
}

/// A surface under construction, in millimetres. Every strip of triangles between two rings faces outwards when the
/// rings run counter-clockwise about the direction of travel, so orientation is right by construction.
#[derive(Debug, Clone)]
pub struct Shell {
    /// Vertices.
    pub points: Vec<Point3<f64>>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[usize; 3]>,
    /// Part of each triangle.
    pub parts: Vec<Part>,
    part: Part,
}

impl Shell {
    /// A surface with no triangles yet, whose next ones belong to `part`.
    pub fn new(part: Part) -> Self {
        Self {
            points: Vec::new(),
            triangles: Vec::new(),
            parts: Vec::new(),
            part,
        }
    }

    /// Triangles made from here on belong to `part`.
    pub fn start(&mut self, part: Part) {
        self.part = part;
    }

    /// Adds a vertex.
    pub fn point(&mut self, point: Point3<f64>) -> usize {
        self.points.push(point);
        self.points.len() - 1
    }

    /// Adds the vertices of a ring.
    pub fn ring(&mut self, points: impl IntoIterator<Item = Point3<f64>>) -> Ring {
        points.into_iter().map(|point| self.point(point)).collect()
    }

    /// Joins two rings by a strip that leaves out the quadrilaterals of the columns in `skip`.
    fn bridge_except(&mut self, from: &[usize], to: &[usize], skip: &Range<usize>) {
        assert_eq!(
            from.len(),
            to.len(),
            "rings that meet have the same number of vertices"
        );
        for column in (0..from.len()).filter(|column| !skip.contains(column)) {
            let next = (column + 1) % from.len();
            self.quad([from[column], from[next], to[next], to[column]]);
        }
    }

    /// Two triangles for a quadrilateral, cut along its shorter diagonal.
    fn quad(&mut self, [a, b, c, d]: [usize; 4]) {
        let length = |i: usize, j: usize| (self.points[i] - self.points[j]).norm();
        if length(a, c) <= length(b, d) {
            self.triangle([a, b, c]);
            self.triangle([a, c, d]);
        } else {
            self.triangle([a, b, d]);
            self.triangle([b, c, d]);
        }
    }

    fn triangle(&mut self, corners: [usize; 3]) {
        self.triangles.push(corners);
        self.parts.push(self.part);
    }

    /// Closes the surface before its first ring with a fan around `apex`.
    pub fn cap_start(&mut self, ring: &[usize], apex: Point3<f64>) {
        let apex = self.point(apex);
        for column in 0..ring.len() {
            self.triangle([ring[(column + 1) % ring.len()], ring[column], apex]);
        }
    }

    /// Closes the surface after its last ring with a fan around `apex`.
    pub fn cap_end(&mut self, ring: &[usize], apex: Point3<f64>) {
        let apex = self.point(apex);
        for column in 0..ring.len() {
            self.triangle([ring[column], ring[(column + 1) % ring.len()], apex]);
        }
    }

    /// Closes the surface after its last ring with a fan around the ring's mean.
    pub fn cap_end_flat(&mut self, ring: &[usize]) {
        let apex = self.mean(ring);
        self.cap_end(ring, apex);
    }

    /// Mean of some vertices.
    pub fn mean(&self, ring: &[usize]) -> Point3<f64> {
        let sum = ring
            .iter()
            .map(|&idx| self.points[idx].coords)
            .sum::<nalgebra::Vector3<f64>>();
        Point3::from(sum / ring.len() as f64)
    }

    /// Drops vertices that no triangle uses: those inside holes.
    pub fn drop_unused(&mut self) {
        let mut kept = vec![None; self.points.len()];
        let mut points = Vec::with_capacity(self.points.len());
        for idx in self.triangles.iter_mut().flatten() {
            *idx = *kept[*idx].get_or_insert_with(|| {
                points.push(self.points[*idx]);
                points.len() - 1
            });
        }
        self.points = points;
    }

    /// Joins rings one after the other, leaving `holes` open for what is attached there.
    pub fn weave(&mut self, rings: &[Ring], holes: &[Hole]) {
        for (row, pair) in rings.windows(2).enumerate() {
            let skip = holes
                .iter()
                .find(|hole| hole.rows.contains(&row))
                .map_or(0..0, |hole| hole.columns.clone());
            self.bridge_except(&pair[0], &pair[1], &skip);
        }
    }
}

/// A rectangle of quadrilaterals left out of woven rings: rows between rings, columns between a ring's vertices.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hole {
    /// Strips left open: strip `i` lies between rings `i` and `i + 1`.
    pub rows: Range<usize>,
    /// Quadrilaterals left open in each strip.
    pub columns: Range<usize>,
}

impl Hole {
    /// Number of vertices on the edge.
    pub fn edge_len(&self) -> usize {
        2 * (self.rows.len() + self.columns.len())
    }

    /// The hole's edge as the first ring of a tube that grows outwards from it. It starts at the corner of first row
    /// and first column and runs along the first row.
    pub fn edge(&self, rings: &[Ring]) -> Ring {
        let (rows, columns) = (&self.rows, &self.columns);
        let mut edge = Vec::with_capacity(self.edge_len());
        edge.extend(columns.clone().map(|column| rings[rows.start][column]));
        edge.extend(rows.clone().map(|row| rings[row][columns.end]));
        edge.extend(
            (columns.start + 1..=columns.end)
                .rev()
                .map(|column| rings[rows.end][column]),
        );
        edge.extend(
            (rows.start + 1..=rows.end)
                .rev()
                .map(|row| rings[row][columns.start]),
        );
        edge
    }

    /// The hole's edge as the last ring of a tube that arrives from outside: the same vertices the other way round,
    /// starting at the corner of last row and first column and running along the last row.
    pub fn edge_of_arrival(&self, rings: &[Ring]) -> Ring {
        let (rows, columns) = (&self.rows, &self.columns);
        let mut edge = Vec::with_capacity(self.edge_len());
        edge.extend(columns.clone().map(|column| rings[rows.end][column]));
        edge.extend(
            (rows.start + 1..=rows.end)
                .rev()
                .map(|row| rings[row][columns.end]),
        );
        edge.extend(
            (columns.start + 1..=columns.end)
                .rev()
                .map(|column| rings[rows.start][column]),
        );
        edge.extend(rows.clone().map(|row| rings[row][columns.start]));
        edge
    }
}
