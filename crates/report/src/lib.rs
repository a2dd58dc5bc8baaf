//! How do results become figures and one page?

mod charts;
mod error;
mod figure;
mod page;
mod palette;
mod picture;
mod sections;
mod sphere_sheet;
mod view;
mod wilson;

pub use error::ReportError;
pub use figure::Figure;
pub use page::{Page, ReportData, render_page};
pub use palette::{cividis, task_color, task_shape};
pub use picture::Picture;
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
pub use sphere_sheet::{DISC_TITLES, SphereRow, SphereSheet};
pub use view::{View, looking_from};
pub use wilson::wilson_interval;
