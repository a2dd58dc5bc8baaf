//! Rasters become PNG files with a palette: about a third of the bytes of full colour, and no visible loss.
//!
//! Rendered pictures hold a few ramps of colour, so 256 well chosen entries do.

use std::collections::BTreeMap;

use crate::raster::Raster;

/// The raster as a PNG: with a palette of at most 256 colours, exact where it has no more, else by median cut.
pub fn encode_png(raster: &Raster) -> Vec<u8> {
    let pixels: Vec<[u8; 4]> = raster
        .rgba
        .chunks_exact(4)
        .map(|p| [p[0], p[1], p[2], p[3]])
        .map(settled)
        .collect();
    let mut counts: BTreeMap<[u8; 4], u32> = BTreeMap::new();
    for pixel in &pixels {
        *counts.entry(*pixel).or_default() += 1;
    }
    let (mut palette, mut entry_of) = (Vec::new(), BTreeMap::new());
    for cell in median_cut(counts.into_iter().collect(), 256) {
        for (color, _) in &cell {
            entry_of.insert(*color, palette.len() as u8);
        }
        palette.push(mean(&cell));
    }
    let indices: Vec<u8> = pixels.iter().map(|p| entry_of[p]).collect();
    write(raster.width as u32, raster.height as u32, &palette, &indices)
}

/// A clear pixel has no colour, and alpha has 32 steps: enough for smooth rims.
fn settled([r, g, b, a]: [u8; 4]) -> [u8; 4] {
    match a {
        0..=3 => [0; 4],
        252.. => [r, g, b, 255],
        _ => [r, g, b, (a / 8) * 8 + 4],
    }
}

type Cell = Vec<([u8; 4], u32)>;

/// Splits the cell with the largest spread, weighted by its pixels, at its median, until there are `n` cells.
fn median_cut(colors: Cell, n: usize) -> Vec<Cell> {
    // Alpha counts double: a wrong colour at a rim is seen less than a wrong rim.
    let spread = |cell: &Cell| -> (u64, usize) {
        let widest = (0..4).map(|k| {
            let of = |c: &([u8; 4], u32)| u64::from(c.0[k]);
            let (low, high) = (
                cell.iter().map(of).min().unwrap_or(0),
                cell.iter().map(of).max().unwrap_or(0),
            );
            ((high - low) * if k == 3 { 2 } else { 1 }, k)
        });
        let (width, axis) = widest
            .max_by_key(|&(width, k)| (width, std::cmp::Reverse(k)))
            .unwrap_or((0, 0));
        let weight: u64 = cell.iter().map(|c| u64::from(c.1)).sum();
        (width * width * (weight as f64).sqrt() as u64, axis)
    };
    let mut cells: Vec<(u64, usize, Cell)> = Vec::new();
    if !colors.is_empty() {
        let (score, axis) = spread(&colors);
        cells.push((score, axis, colors));
    }
    while cells.len() < n {
        let Some(widest) = (0..cells.len()).max_by_key(|&i| (cells[i].0, std::cmp::Reverse(i))) else {
            break;
        };
        if cells[widest].0 == 0 {
            break;
        }
        let (_, axis, mut cell) = cells.swap_remove(widest);
        cell.sort_by_key(|c| (c.0[axis], c.0));
        let half = cell.iter().map(|c| u64::from(c.1)).sum::<u64>() / 2;
        let mut before = 0;
        let cut = cell.iter().position(|c| {
            before += u64::from(c.1);
            before > half
        });
        let cut = cut.unwrap_or(0).clamp(1, cell.len() - 1);
        let upper = cell.split_off(cut);
        for part in [cell, upper] {
            let (score, axis) = spread(&part);
            cells.push((score, axis, part));
        }
    }
    cells.into_iter().map(|(_, _, cell)| cell).collect()
}

fn mean(cell: &Cell) -> [u8; 4] {
    let n: u64 = cell.iter().map(|c| u64::from(c.1)).sum();
    std::array::from_fn(|k| {
        let sum: u64 = cell.iter().map(|c| u64::from(c.0[k]) * u64::from(c.1)).sum();
        ((sum + n / 2) / n.max(1)) as u8
    })
}

fn write(width: u32, height: u32, palette: &[[u8; 4]], indices: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(
        palette
            .iter()
            .flat_map(|c| [c[0], c[1], c[2]])
            .collect::<Vec<u8>>(),
    );
    encoder.set_trns(palette.iter().map(|c| c[3]).collect::<Vec<u8>>());
    encoder.set_compression(png::Compression::High);
    encoder.set_filter(png::Filter::NoFilter);
    let mut writer = encoder
        .write_header()
        .expect("a palette image within 8192 × 8192 pixels has a header");
    writer
        .write_image_data(indices)
        .expect("one index a pixel, written to memory");
    writer.finish().expect("written to memory");
    bytes
}
