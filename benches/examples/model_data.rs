//! Rows of the paper's network as CSV, its network file, and the model that they come from.
//!
//! ```text
//! cargo run --release -p prehend-benches --example model_data -- rows 3600 SEED [SHARE_OF_GAPS] > rows.csv
//! cargo run --release -p prehend-benches --example model_data -- network ['{ max = 6, choose = "bic" }'] > paper.toml
//! cargo run --release -p prehend-benches --example model_data -- model > truth.json
//! ```

use std::io::Write;

use prehend::model::{Column, Table};
use prehend_benches::paper_network;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    match words.as_slice() {
        ["rows", n, seed, gaps @ ..] => {
            let mut table = paper_network::truth()?.sample(n.parse()?, seed.parse()?);
            if let [share] = gaps {
                table = paper_network::with_gaps(&table, share.parse()?, seed.parse()?)?;
            }
            write_csv(&table, &mut out)?;
        }
        ["network", mixture @ ..] => {
            out.write_all(paper_network::network(mixture.first().copied()).as_bytes())?;
        }
        ["model"] => out.write_all(paper_network::truth()?.to_json().as_bytes())?,
        _ => return Err("expected `rows N SEED [GAPS]`, `network [MIXTURE]` or `model`".into()),
    }
    Ok(())
}

fn write_csv(table: &Table, out: &mut impl Write) -> std::io::Result<()> {
    let names: Vec<&str> = table.names().collect();
    writeln!(out, "{}", names.join(","))?;
    for row in 0..table.n_rows() {
        for (i, name) in names.iter().enumerate() {
            let comma = if i > 0 { "," } else { "" };
            match table.column(name) {
                Some(Column::Numbers(v)) if v[row].is_nan() => write!(out, "{comma}")?,
                Some(Column::Numbers(v)) => write!(out, "{comma}{}", v[row])?,
                Some(Column::Text(v)) => write!(out, "{comma}{}", v[row])?,
                None => {}
            }
        }
        writeln!(out)?;
    }
    Ok(())
}
