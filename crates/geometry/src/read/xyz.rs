//! XYZ clouds: a line per point, `x y z`, apart by blanks, commas or semicolons; what follows (normals, colours) is
//! passed over. A first line of names (`x y z`, `//X Y Z`) or with the number of points may lead.

use nalgebra::Point3;

use super::cloud;
use super::text::{Place, decode, records};
use crate::GeometryError;

const FORMAT: &str = "XYZ";

pub(super) fn read(bytes: &[u8]) -> Result<Vec<Point3<f64>>, GeometryError> {
    let text = decode(bytes);
    let mut points = Vec::new();
    for (nth, (line, record)) in records(&text).enumerate() {
        let record = record.trim_start_matches('\u{feff}');
        let mut words = record
            .split([' ', '\t', ',', ';'])
            .filter(|word| !word.is_empty());
        if nth == 0 && is_head(record, words.clone().count()) {
            continue;
        }
        points.push(Place { format: FORMAT, line }.point(&mut words)?);
    }
    cloud(points)
}

fn is_head(record: &str, n_words: usize) -> bool {
    let names = record.trim_start_matches('/').trim_start();
    names.starts_with(['x', 'X']) || (n_words == 1 && record.parse::<usize>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn separators_heads_and_further_columns_do_not_matter() {
        let expected = [Point3::new(1.0, 2.0, 3.0), Point3::new(-1.0, 0.5, 1e-3)];
        for text in [
            "1 2 3\n-1 .5 1e-3\n",
            "x,y,z\n1,2,3\n-1,0.5,0.001",
            "2\n1 2 3 0 0 1\n-1\t0.5\t0.001\t1\n",
            "//X Y Z\n# c\n1;2;3\r\n-1;0.5;0.001\r\n",
        ] {
            assert_eq!(read(text.as_bytes()).unwrap(), expected, "{text}");
        }
    }

    #[test]
    fn messages_name_line_found_and_expected() {
        let message = |text: &str| read(text.as_bytes()).unwrap_err().to_string();
        assert_eq!(
            message("1 2 3\n1 2\n"),
            "XYZ, line 2: found the end of the line, expected three coordinates"
        );
        assert_eq!(
            message("1 2 3\n1 b 2\n"),
            "XYZ, line 2: found `b`, expected a finite number"
        );
        assert_eq!(
            message("# none\n"),
            "the shape has no points; check that the file is complete"
        );
    }
}
