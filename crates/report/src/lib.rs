//! How do results become figures and one page?

mod camera;
mod charts;
mod compositions;
mod display_mesh;
mod error;
mod figure;
mod icosphere;
mod linear_light;
mod page;
mod palette;
mod palette_png;
mod picture;
mod raster;
mod scene;
mod sections;
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
pub use page::{Page, ReportData, render_page};
pub use palette::{cividis, task_color, task_shape};
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
