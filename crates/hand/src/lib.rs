//! Where is every link of a hand in this posture?
//!
//! A [`Hand`] is read from the text of a URDF, behind a validator that checks what URDF readers usually do not: that
//! the links form one tree, that axes have a direction and limits an order, that mimic joints follow something. Its
//! links carry solids in their own frames; [`Hand::link_poses`] says where the links stand in a posture.
//!
//! How a hand grasps — where its palm looks, which joints close it, which directions in joint space its pre-shapes are
//! made of, what its links are made of — stands in a `hand.toml` beside the URDF and is added by
//! [`Hand::with_description`]. Hands are data: no code here knows any hand's name. Where nobody wrote one,
//! [`Hand::propose_description`] works it out from shape and kinematics, and says how sure it is.
//!
//! Lengths are metres, angles radians, masses kilograms. This crate opens no files: mesh bytes come from a resolver.
//!
//! # Examples
//!
//! ```
//! use std::collections::BTreeMap;
//! use prehend_hand::Hand;
//!
//! let urdf = r#"<robot name="finger">
//!   <link name="base"/>
//!   <link name="tip"><collision><geometry><sphere radius="0.01"/></geometry></collision></link>
//!   <joint name="knuckle" type="revolute">
//!     <parent link="base"/> <child link="tip"/>
//!     <origin xyz="0 0 0.1"/> <axis xyz="0 2 0"/>
//!     <limit lower="0" upper="1.6" effort="1" velocity="1"/>
//!   </joint>
//! </robot>"#;
//! let hand = Hand::from_urdf(urdf, &|file| Err(format!("{file} is not at hand")))?;
//! let bent = hand.positions(&BTreeMap::from([("knuckle".to_owned(), std::f64::consts::FRAC_PI_2)]))?;
//! let tip = hand.link_named("tip").expect("the URDF has it");
//! let root_from_tip = hand.link_poses(&bent).root_from_link(tip);
//! let outwards = root_from_tip * nalgebra::Vector3::z();
//! assert!((outwards - nalgebra::Vector3::x()).norm() < 1e-12);
//! # Ok::<(), prehend_hand::HandError>(())
//! ```

mod description;
mod error;
mod hand;
mod hand_toml;
mod kinematics;
mod posture;
mod propose;
mod shape;
mod urdf;
mod xml;

pub use description::{Closing, Description, Eigengrasp, Finger, PalmFrame};
pub use error::HandError;
pub use hand::{Hand, Joint, JointIdx, JointKind, Link, LinkIdx, Mimic};
pub use hand_toml::urdf_named_in;
pub use kinematics::LinkPoses;
pub use posture::JointPositions;
pub use propose::{Confidence, Guess, Proposal};
pub use shape::Resolve;
pub use xml::urdf_below;
