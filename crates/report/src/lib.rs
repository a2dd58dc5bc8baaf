//! How do results become figures and one page?
//!
//! The crate knows no files. It takes numbers, meshes and hands, and gives back a page ([`render_page`]) and the
//! figures beside it as bytes. The caller fills [`ReportData`] and writes what comes back; nothing is read, timed or
//! drawn at random here, so the same data give the same bytes.
//!
//! **Pictures.** A [`Scene`] holds bodies, lines and dots; [`draw`] rasterises it through an orthographic [`Camera`]:
//! depth buffer, 3 × 3 samples a pixel, normals smoothed where faces meet at less than 45°, three lights that go with the
//! camera, dark lines at rims and creases, a transparent ground. [`Scene::boxes`], [`Scene::parts`] and [`Scene::grasp`]
//! compose what the report shows; [`encode_png`] makes files of it. Meshes are prepared once as [`DisplayMesh`], hands as
//! [`HandShape`], and drawn often.
//!
//! **Maps.** [`Icosphere`] gives directions and weights, [`sphere_sheet`] draws densities over them: six views with the
//! object inside, and two equal-area discs.
//!
//! **Charts.** Bars and curves come from the chart crate `kuva`, behind a module of our own; confusion matrices and bars
//! under pictures hold text and images in places that it has no room for, and are drawn here as SVG. Colours are written
//! plainly in the figures' files and become CSS variables in the page, which follows the reader's light or dark theme.
//!
//! **The page** needs no script and no other file, and forbids itself both. Every experiment is told the same way:
//! question, answer, figures and tables, how it was measured, what it does not show ([`Account`]).
//!
//! # Examples
//!
//! ```
//! use std::sync::Arc;
//! use prehend_geometry::{OrientedBox, Solid};
//! use prehend_report::{DisplayMesh, ObjectSection, ReportData, Scene, View, render_page};
//!
//! let ball = Arc::new(DisplayMesh::new(&Solid::Sphere { radius: 0.03 }.display_mesh()));
//! let boxes = Scene::boxes(&ball, &[OrientedBox::centered([0.06; 3])]);
//! let boxes = boxes.picture(View::Oblique, 80, "ball-boxes", "A ball in its box.")?;
//! let ball = ObjectSection { name: "ball".into(), object_type: "toy".into(), boxes, ..ObjectSection::default() };
//!
//! let page = render_page(&ReportData { objects: vec![ball], ..ReportData::default() });
//! assert!(page.html.contains("A ball in its box."));
//! assert_eq!(page.figures[0].0, "ball-boxes.png");
//! # Ok::<(), prehend_report::ReportError>(())
//! ```

mod camera;
mod charts;
mod compositions;
mod display_mesh;
mod error;
mod figure;
mod icosphere;
mod linear_light;
mod network_picture;
mod page;
mod palette;
mod palette_png;
mod picture;
mod raster;
mod scene;
mod sections;
mod sphere_panel;
mod sphere_sheet;
mod view;
mod wilson;

pub use camera::Camera;
pub use compositions::{
    BOX_COLOR, CONTACT_COLOR, HAND_COLOR, HandShape, OBJECT_COLOR, PARTS_LEGEND, PartMarks,
};
pub use display_mesh::DisplayMesh;
pub use error::ReportError;
pub use figure::Figure;
pub use icosphere::Icosphere;
pub use network_picture::{NetworkArc, NetworkNode, network_dot, network_figure};
pub use page::{Page, ReportData, render_page};
pub use palette::{task_color, task_shape, viridis};
pub use palette_png::encode_png;
pub use picture::Picture;
pub use raster::{DrawOptions, Raster, draw};
pub use scene::{Body, Dot, Line, Scene};
pub use sections::account::Account;
pub use sections::experiment_a::{ExperimentA, NetworkMaps, ObjectMaps};
pub use sections::experiment_b::{Confusion, Confusions, ExperimentB, paper_recall};
pub use sections::experiment_c::{Candidate, ExperimentC, ImitationRun};
pub use sections::labels::{Agreement, HandLabels, LabelSection, Prevalence, Rule};
pub use sections::objects::{GraspPicture, GraspSheet, ObjectSection};
pub use sections::run::{RunSection, Stage};
pub use sections::summary::{KeyNumber, Summary};
pub use sections::training::{NetworkTraining, NodeTraining};
pub use sections::tries::TriesRow;
pub use sphere_sheet::{DISC_TITLES, SphereMap, SphereRow, SphereSheet, sphere_sheet};
pub use view::{View, looking_from};
pub use wilson::wilson_interval;
