//! A URDF's XML: the elements that say something of shape or motion, with errors that name element and line.
//!
//! What else stands in the file (transmissions, simulators' elements, inertias, efforts) is not looked at, so that
//! it may be incomplete.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use roxmltree::{Document, Node};

use crate::HandError;

/// A URDF as it is written, its numbers not judged.
pub(crate) struct Robot {
    pub name: String,
    pub links: Vec<RawLink>,
    pub joints: Vec<RawJoint>,
}

/// A `<link>`.
pub(crate) struct RawLink {
    pub name: String,
    pub mass: Option<f64>,
    pub collision: Vec<RawShape>,
    pub visual: Vec<RawShape>,
}

/// A `<collision>` or `<visual>`.
pub(crate) struct RawShape {
    pub origin: RawPose,
    pub geometry: Geometry,
}

/// An `<origin>`.
#[derive(Clone, Copy, Default)]
pub(crate) struct RawPose {
    pub xyz: [f64; 3],
    pub rpy: [f64; 3],
}

/// What stands in a `<geometry>`.
pub(crate) enum Geometry {
    Box { size: [f64; 3] },
    Cylinder { radius: f64, length: f64 },
    Capsule { radius: f64, length: f64 },
    Sphere { radius: f64 },
    Mesh { filename: String, scale: [f64; 3] },
}

/// A `<joint>`.
pub(crate) struct RawJoint {
    pub name: String,
    pub kind: String,
    pub parent: String,
    pub child: String,
    pub origin: RawPose,
    pub axis: [f64; 3],
    /// Both 0 where they are not given.
    pub lower: f64,
    pub upper: f64,
    pub mimic: Option<RawMimic>,
}

/// A `<mimic>`.
pub(crate) struct RawMimic {
    pub joint: String,
    pub multiplier: f64,
    pub offset: f64,
}

/// Reads the text.
pub(crate) fn read(urdf: &str) -> Result<Robot, HandError> {
    let text = with_prefixes_declared(urdf);
    let document = parse(&text)?;
    let robot = document.root_element();
    let mut links = Vec::new();
    let mut joints = Vec::new();
    for node in robot.children().filter(Node::is_element) {
        match node.tag_name().name() {
            "link" => links.push(link(&Element::named(node, "link")?)?),
            "joint" => joints.push(joint(&Element::named(node, "joint")?)?),
            _ => {}
        }
    }
    Ok(Robot {
        name: robot.attribute("name").unwrap_or("robot").to_owned(),
        links,
        joints,
    })
}

/// Most prefixes that a file may use without declaring them.
const MOST_PREFIXES: usize = 16;

/// The text with a declaration in `<robot>` of each prefix (`drake:`, `xacro:`) that it uses without one.
fn with_prefixes_declared(urdf: &str) -> Cow<'_, str> {
    let mut text = Cow::Borrowed(urdf);
    for _ in 0..MOST_PREFIXES {
        let body = text.trim_start_matches('\u{feff}').trim_start();
        let Err(roxmltree::Error::UnknownNamespace(prefix, _)) = Document::parse(body) else {
            break;
        };
        let Some(at) = text.find("<robot").map(|at| at + "<robot".len()) else {
            break;
        };
        let declaration = format!(" xmlns:{prefix}=\"{prefix}\"");
        text.to_mut().insert_str(at, &declaration);
    }
    text
}

/// The document, with `<robot>` as its outermost element.
fn parse(urdf: &str) -> Result<Document<'_>, HandError> {
    // Some files start with an empty line, which XML forbids before its declaration.
    let body = urdf.trim_start_matches('\u{feff}').trim_start();
    let document = Document::parse(body).map_err(|error| HandError::Urdf {
        place: place_of(body, &error).map_or("document".to_owned(), |(row, element)| {
            let line = row + urdf[..urdf.len() - body.len()].matches('\n').count();
            format!("line {line}{element}")
        }),
        reason: format!("{error}; check that the file is complete and well-formed XML"),
    })?;
    if document.root_element().tag_name().name() != "robot" {
        return Err(HandError::Urdf {
            place: "document".into(),
            reason: format!(
                "the outermost element is <{}>; expected the <robot> of a URDF",
                document.root_element().tag_name().name()
            ),
        });
    }
    Ok(document)
}

/// The line of an error, and the link or joint that begins last before it.
fn place_of(text: &str, error: &roxmltree::Error) -> Option<(usize, String)> {
    let until = match error {
        roxmltree::Error::UnclosedRootNode | roxmltree::Error::UnexpectedEndOfStream => text.len(),
        error if error.pos().row == 1 && error.pos().col == 1 => return None,
        error => {
            let lines = text.split_inclusive('\n').map(str::len);
            lines.take(error.pos().row as usize).sum()
        }
    };
    let before = &text[..until];
    let begins = |tag: &str| before.rfind(&format!("<{tag} ")).map(|at| (at, tag.to_owned()));
    let element = begins("link").max(begins("joint")).and_then(|(at, tag)| {
        let (_, rest) = before[at..].split_once("name=")?;
        let quote = rest.chars().next().filter(|c| *c == '"' || *c == '\'')?;
        let name = rest[1..].split(quote).next()?;
        Some(format!(", in or after {tag} `{name}`"))
    });
    let row = before.trim_end().matches('\n').count() + 1;
    Some((row, element.unwrap_or_default()))
}

fn link(element: &Element<'_, '_>) -> Result<RawLink, HandError> {
    let mass = element.child("inertial").and_then(|i| i.child("mass"));
    Ok(RawLink {
        name: element.name.clone(),
        mass: mass.map(|m| m.number("value")).transpose()?.flatten(),
        collision: element
            .children("collision")
            .map(|c| shape(&c)?.ok_or_else(|| c.fault("it has no <geometry>; give it one, or delete it")))
            .collect::<Result<_, _>>()?,
        visual: element
            .children("visual")
            .filter_map(|v| shape(&v).transpose())
            .collect::<Result<_, _>>()?,
    })
}

/// The shape in a `<collision>` or `<visual>`; `None` where it has no geometry.
fn shape(element: &Element<'_, '_>) -> Result<Option<RawShape>, HandError> {
    let Some(geometry) = element.child("geometry") else {
        return Ok(None);
    };
    let Some(node) = geometry.node.children().find(Node::is_element) else {
        return Ok(None);
    };
    let solid = geometry.inner(node);
    let geometry = match node.tag_name().name() {
        "box" => Geometry::Box {
            size: solid.needed("size", Element::numbers)?,
        },
        "cylinder" => Geometry::Cylinder {
            radius: solid.needed("radius", Element::number)?,
            length: solid.needed("length", Element::number)?,
        },
        "capsule" => Geometry::Capsule {
            radius: solid.needed("radius", Element::number)?,
            length: solid.needed("length", Element::number)?,
        },
        "sphere" => Geometry::Sphere {
            radius: solid.needed("radius", Element::number)?,
        },
        "mesh" => Geometry::Mesh {
            filename: solid.text("filename")?.to_owned(),
            scale: solid.numbers("scale")?.unwrap_or([1.0; 3]),
        },
        other => {
            return Err(solid.fault(&format!(
                "<{other}> is not a shape that is read; expected box, cylinder, capsule, sphere or mesh"
            )));
        }
    };
    Ok(Some(RawShape {
        origin: element.pose()?,
        geometry,
    }))
}

fn joint(element: &Element<'_, '_>) -> Result<RawJoint, HandError> {
    let end = |which: &'static str| {
        let end = element.child(which);
        let end = end.ok_or_else(|| element.fault(&format!("it has no <{which} link=\"…\"/>")))?;
        end.text("link").map(str::to_owned)
    };
    let limit = element.child("limit");
    let limit = |which: &str| {
        let value = limit.as_ref().map(|l| l.number(which)).transpose()?;
        Ok::<f64, HandError>(value.flatten().unwrap_or(0.0))
    };
    let mimic = element.child("mimic").map(|m| {
        Ok::<RawMimic, HandError>(RawMimic {
            joint: m.text("joint")?.to_owned(),
            multiplier: m.number("multiplier")?.unwrap_or(1.0),
            offset: m.number("offset")?.unwrap_or(0.0),
        })
    });
    let axis = element.child("axis").map(|a| a.numbers("xyz")).transpose()?;
    Ok(RawJoint {
        name: element.name.clone(),
        kind: element.text("type")?.to_owned(),
        parent: end("parent")?,
        child: end("child")?,
        origin: element.pose()?,
        // As the format says.
        axis: axis.flatten().unwrap_or([1.0, 0.0, 0.0]),
        lower: limit("lower")?,
        upper: limit("upper")?,
        mimic: mimic.transpose()?,
    })
}

/// The URDF of what hangs on one link, which becomes the root: for a hand at the end of an arm.
///
/// Links and joints that do not hang on it are cut out, and so is what says neither shape nor motion but names joints
/// (`<transmission>`, `<gazebo>`); all else stays as it is, comments and materials among it.
///
/// # Errors
///
/// [`HandError::Urdf`] for text that is no URDF, or that has no such link.
///
/// # Examples
///
/// ```
/// let urdf = r#"<robot name="r"><link name="arm"/><link name="hand"/>
///   <joint name="wrist" type="fixed"><parent link="arm"/><child link="hand"/></joint></robot>"#;
/// let hand = prehend_hand::urdf_below(urdf, "hand")?;
/// assert_eq!(hand.split_whitespace().collect::<Vec<_>>().join(" "), r#"<robot name="r"><link name="hand"/> </robot>"#);
/// # Ok::<(), prehend_hand::HandError>(())
/// ```
pub fn urdf_below(urdf: &str, link: &str) -> Result<String, HandError> {
    let robot = read(urdf)?;
    if !robot.links.iter().any(|l| l.name == link) {
        let names: Vec<&str> = robot.links.iter().map(|l| l.name.as_str()).collect();
        return Err(HandError::Urdf {
            place: format!("link `{link}`"),
            reason: format!("there is none; the links are {}", names.join(", ")),
        });
    }
    let mut below = BTreeSet::from([link]);
    loop {
        let found = robot.joints.iter().filter(|j| below.contains(j.parent.as_str()));
        let found: Vec<&str> = found.map(|j| j.child.as_str()).collect();
        let n = below.len();
        below.extend(found);
        if below.len() == n {
            break;
        }
    }
    let parents: BTreeMap<&str, &str> = robot
        .joints
        .iter()
        .map(|j| (j.name.as_str(), j.parent.as_str()))
        .collect();
    let declared = with_prefixes_declared(urdf);
    let document = parse(&declared)?;
    let text = document.input_text();
    let mut out = String::with_capacity(text.len());
    let mut done = 0;
    for node in document.root_element().children().filter(Node::is_element) {
        let name = node.attribute("name").unwrap_or_default();
        let stays = match node.tag_name().name() {
            "link" => below.contains(name),
            "joint" => parents.get(name).is_some_and(|parent| below.contains(parent)),
            "transmission" | "gazebo" => false,
            _ => true,
        };
        if !stays {
            out += text[done..node.range().start].trim_end_matches([' ', '\t']);
            done = node.range().end;
        }
    }
    Ok(out + &text[done..])
}

/// An element, and the link or joint that it is or stands in.
struct Element<'a, 'input> {
    node: Node<'a, 'input>,
    what: &'static str,
    name: String,
}

impl<'a, 'input> Element<'a, 'input> {
    fn named(node: Node<'a, 'input>, what: &'static str) -> Result<Self, HandError> {
        let name = node.attribute("name").unwrap_or("?").to_owned();
        let element = Self { node, what, name };
        element.text("name")?;
        Ok(element)
    }

    fn inner(&self, node: Node<'a, 'input>) -> Self {
        Self {
            node,
            what: self.what,
            name: self.name.clone(),
        }
    }

    fn children(&self, tag: &'static str) -> impl Iterator<Item = Self> + '_ {
        let elements = self.node.children().filter(Node::is_element);
        elements
            .filter(move |n| n.tag_name().name() == tag)
            .map(|n| self.inner(n))
    }

    fn child(&self, tag: &'static str) -> Option<Self> {
        self.children(tag).next()
    }

    /// An attribute that must be there.
    fn text(&self, attribute: &str) -> Result<&'a str, HandError> {
        let value = self.node.attribute(attribute);
        value.ok_or_else(|| self.lacks(attribute))
    }

    fn number(&self, attribute: &str) -> Result<Option<f64>, HandError> {
        let parse = |text: &str| {
            let number = text.trim().parse().ok();
            number.ok_or_else(|| self.is_not(attribute, text, "a number"))
        };
        self.node.attribute(attribute).map(parse).transpose()
    }

    fn numbers(&self, attribute: &str) -> Result<Option<[f64; 3]>, HandError> {
        let parse = |text: &str| {
            let numbers: Option<Vec<f64>> = text.split_whitespace().map(|n| n.parse().ok()).collect();
            let numbers = numbers.and_then(|n| <[f64; 3]>::try_from(n).ok());
            numbers.ok_or_else(|| self.is_not(attribute, text, "three numbers"))
        };
        self.node.attribute(attribute).map(parse).transpose()
    }

    fn needed<T>(
        &self,
        attribute: &str,
        read: impl Fn(&Self, &str) -> Result<Option<T>, HandError>,
    ) -> Result<T, HandError> {
        read(self, attribute)?.ok_or_else(|| self.lacks(attribute))
    }

    fn pose(&self) -> Result<RawPose, HandError> {
        let Some(origin) = self.child("origin") else {
            return Ok(RawPose::default());
        };
        Ok(RawPose {
            xyz: origin.numbers("xyz")?.unwrap_or_default(),
            rpy: origin.numbers("rpy")?.unwrap_or_default(),
        })
    }

    fn lacks(&self, attribute: &str) -> HandError {
        self.fault(&format!(
            "<{}> lacks `{attribute}`; add it",
            self.node.tag_name().name()
        ))
    }

    fn is_not(&self, attribute: &str, found: &str, expected: &str) -> HandError {
        let tag = self.node.tag_name().name();
        self.fault(&format!(
            "`{attribute}` of <{tag}> is `{found}`; expected {expected}"
        ))
    }

    fn fault(&self, reason: &str) -> HandError {
        let document = self.node.document();
        let line = document.text_pos_at(self.node.range().start).row;
        HandError::Urdf {
            place: format!("{} `{}` (line {line})", self.what, self.name),
            reason: reason.to_owned(),
        }
    }
}
