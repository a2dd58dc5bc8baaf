//! The binary form of a model: a header of our own, then bincode. Lossless to and from `model.json`.
//!
//! ```text
//! 0   8   magic  "PREHENDM"
//! 8   4   version, little endian
//! 12  8   length of the body
//! 20  32  SHA-256 of the body
//! 52      body: bincode 2, standard configuration
//! ```
//!
//! bincode is no longer maintained; this module is the only place that knows it (`docs/decisions/bincode.md`).

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::cpd::{Component, Cpd, DiscreteCpd, MixtureCpd, NodeIdx, Scaling, Sign, Weights};
use crate::error::ModelError;
use crate::extra::Extra;
use crate::model::{Model, Node};
use crate::von_mises_fisher::{VonMisesFisher, VonMisesFisherCpd};

const MAGIC: &[u8; 8] = b"PREHENDM";
const VERSION: u32 = 2;
const HEADER: usize = 52;
/// Most bytes that decoding may ask for: a damaged length must not exhaust memory.
const LIMIT: usize = 1 << 30;

/// What stands in the body. Keys that the program does not know travel as JSON text.
#[derive(Serialize, Deserialize)]
struct Stored {
    nodes: Vec<StoredNode>,
    extra: String,
}

#[derive(Serialize, Deserialize)]
struct StoredNode {
    name: String,
    extra: String,
    cpd: StoredCpd,
}

#[derive(Serialize, Deserialize)]
enum StoredCpd {
    Discrete {
        states: Vec<String>,
        parents: Vec<usize>,
        table: Vec<Vec<f64>>,
    },
    Mixture {
        columns: Vec<String>,
        discrete_parents: Vec<usize>,
        continuous_parents: Vec<usize>,
        weights: Weights,
        latent_sign: bool,
        sphere: bool,
        scaling: Option<Scaling>,
        components: Vec<Vec<StoredComponent>>,
    },
    VonMisesFisher {
        columns: Vec<String>,
        discrete_parents: Vec<usize>,
        /// Weight, direction and concentration.
        components: Vec<Vec<(f64, Vec<f64>, f64)>>,
    },
}

/// Matrices row by row; their shapes follow from `mean` and `n_parents`.
#[derive(Serialize, Deserialize)]
struct StoredComponent {
    weight: f64,
    mean: Vec<f64>,
    n_parents: usize,
    coefficients: Vec<f64>,
    covariance: Vec<f64>,
}

impl Model {
    /// The binary form.
    pub fn to_bytes(&self) -> Vec<u8> {
        let text = |extra: &Extra| serde_json::to_string(extra.keys()).unwrap_or_else(|_| "{}".into());
        let stored = Stored {
            nodes: self
                .nodes()
                .iter()
                .map(|node| StoredNode {
                    name: node.name.clone(),
                    extra: text(&node.extra),
                    cpd: store(&node.cpd),
                })
                .collect(),
            extra: text(self.extra()),
        };
        // Encoding into memory fails for unsized sequences only, and there are none.
        let body = bincode::serde::encode_to_vec(&stored, bincode::config::standard()).unwrap_or_default();
        let mut out = Vec::with_capacity(HEADER + body.len());
        out.extend_from_slice(MAGIC);
        out.extend_from_slice(&VERSION.to_le_bytes());
        out.extend_from_slice(&(body.len() as u64).to_le_bytes());
        out.extend_from_slice(&Sha256::digest(&body));
        out.extend_from_slice(&body);
        out
    }

    /// Reads the binary form.
    ///
    /// # Errors
    ///
    /// [`ModelError::Binary`] where the header, length or hash is wrong; otherwise what [`Model::new`] finds.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ModelError> {
        let bad = |found: String, expected: &str| ModelError::Binary {
            found,
            expected: expected.into(),
        };
        if bytes.len() < HEADER || &bytes[..8] != MAGIC {
            let found = format!(
                "{} bytes that begin with {:?}",
                bytes.len(),
                &bytes[..bytes.len().min(8)]
            );
            return Err(bad(
                found,
                "the header PREHENDM; write the model again with `train` or `model convert`",
            ));
        }
        let word = |from: usize, to: usize| {
            bytes[from..to]
                .iter()
                .rev()
                .fold(0u64, |value, byte| value << 8 | u64::from(*byte))
        };
        let version = word(8, 12);
        if version != u64::from(VERSION) {
            return Err(bad(
                format!("version {version}"),
                "version 2; convert the .json that was written beside it, or train again",
            ));
        }
        let body = &bytes[HEADER..];
        if word(12, 20) != body.len() as u64 {
            let found = format!("{} bytes after the header", body.len());
            return Err(bad(
                found,
                &format!("{} bytes; the file is cut off or has grown", word(12, 20)),
            ));
        }
        if bytes[20..HEADER] != Sha256::digest(body)[..] {
            return Err(bad(
                "a body of another hash".into(),
                "the hash in the header; the file is damaged",
            ));
        }
        let config = bincode::config::standard().with_limit::<LIMIT>();
        let (stored, read): (Stored, usize) =
            bincode::serde::decode_from_slice(body, config).map_err(|e| {
                bad(
                    format!("a body that does not decode ({e})"),
                    "the fields of version 2",
                )
            })?;
        if read != body.len() {
            return Err(bad(
                format!("{} bytes too many", body.len() - read),
                "the end of the model",
            ));
        }
        let extra = |text: &str| {
            serde_json::from_str(text)
                .map(Extra::new)
                .map_err(|e| bad(format!("further keys that are no JSON ({e})"), "an object"))
        };
        let nodes = stored
            .nodes
            .into_iter()
            .map(|node| {
                Ok(Node {
                    extra: extra(&node.extra)?,
                    cpd: load(&node.name, node.cpd)?,
                    name: node.name,
                })
            })
            .collect::<Result<Vec<_>, ModelError>>()?;
        let n = nodes.len();
        let astray = nodes
            .iter()
            .find(|node| node.parents().iter().any(|parent| parent.0 >= n));
        if let Some(node) = astray {
            return Err(bad(
                format!("a parent of `{}` beyond the last node", node.name),
                "positions of nodes",
            ));
        }
        Self::new(nodes, extra(&stored.extra)?)
    }
}

fn store(cpd: &Cpd) -> StoredCpd {
    let positions = |parents: &[NodeIdx]| parents.iter().map(|parent| parent.0).collect();
    match cpd {
        Cpd::Discrete(cpd) => StoredCpd::Discrete {
            states: cpd.states.clone(),
            parents: positions(&cpd.parents),
            table: cpd.table.clone(),
        },
        Cpd::VonMisesFisher(cpd) => StoredCpd::VonMisesFisher {
            columns: cpd.columns.clone(),
            discrete_parents: positions(&cpd.discrete_parents),
            components: cpd
                .components
                .iter()
                .map(|row| {
                    row.iter()
                        .map(|c| (c.weight, c.direction.iter().copied().collect(), c.concentration))
                        .collect()
                })
                .collect(),
        },
        Cpd::Mixture(cpd) => StoredCpd::Mixture {
            columns: cpd.columns.clone(),
            discrete_parents: positions(&cpd.discrete_parents),
            continuous_parents: positions(&cpd.continuous_parents),
            weights: cpd.weights,
            latent_sign: cpd.sign == Sign::Latent,
            sphere: cpd.sphere,
            scaling: cpd.scaling.clone(),
            components: cpd
                .components
                .iter()
                .map(|row| {
                    row.iter()
                        .map(|c| StoredComponent {
                            weight: c.weight,
                            mean: c.mean.iter().copied().collect(),
                            n_parents: c.coefficients.ncols(),
                            coefficients: c.coefficients.transpose().iter().copied().collect(),
                            covariance: c.covariance.transpose().iter().copied().collect(),
                        })
                        .collect()
                })
                .collect(),
        },
    }
}

fn load(name: &str, cpd: StoredCpd) -> Result<Cpd, ModelError> {
    let nodes = |positions: Vec<usize>| positions.into_iter().map(NodeIdx).collect();
    Ok(match cpd {
        StoredCpd::Discrete {
            states,
            parents,
            table,
        } => Cpd::Discrete(DiscreteCpd {
            states,
            parents: nodes(parents),
            table,
        }),
        StoredCpd::VonMisesFisher {
            columns,
            discrete_parents,
            components,
        } => Cpd::VonMisesFisher(VonMisesFisherCpd {
            columns,
            discrete_parents: nodes(discrete_parents),
            components: components
                .into_iter()
                .map(|row| {
                    row.into_iter()
                        .map(|(weight, direction, concentration)| VonMisesFisher {
                            weight,
                            direction: nalgebra::DVector::from_vec(direction),
                            concentration,
                        })
                        .collect()
                })
                .collect(),
        }),
        StoredCpd::Mixture {
            columns,
            discrete_parents,
            continuous_parents,
            weights,
            latent_sign,
            sphere,
            scaling,
            components,
        } => Cpd::Mixture(MixtureCpd {
            columns,
            discrete_parents: nodes(discrete_parents),
            continuous_parents: nodes(continuous_parents),
            components: components
                .into_iter()
                .map(|row| {
                    row.into_iter()
                        .map(|c| c.load(name))
                        .collect::<Result<Vec<_>, _>>()
                })
                .collect::<Result<Vec<_>, _>>()?,
            weights,
            sign: if latent_sign { Sign::Latent } else { Sign::Fixed },
            sphere,
            scaling,
        }),
    })
}

impl StoredComponent {
    fn load(self, node: &str) -> Result<Component, ModelError> {
        let d = self.mean.len();
        let fits = self.covariance.len() == d * d
            && d.checked_mul(self.n_parents)
                .is_some_and(|n| n == self.coefficients.len());
        if !fits {
            return Err(ModelError::Binary {
                found: format!("a component of `{node}` whose matrices do not fit its mean"),
                expected: format!("{d} × {} coefficients and {d} × {d} covariances", self.n_parents),
            });
        }
        Ok(Component {
            weight: self.weight,
            coefficients: nalgebra::DMatrix::from_row_slice(d, self.n_parents, &self.coefficients),
            covariance: nalgebra::DMatrix::from_row_slice(d, d, &self.covariance),
            mean: nalgebra::DVector::from_vec(self.mean),
        })
    }
}
