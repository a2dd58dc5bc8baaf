//! Colours in linear light, multiplied by their alpha, and their way to sRGB bytes.

use std::sync::LazyLock;

/// Red, green, blue in linear light multiplied by alpha, and alpha.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rgba(pub [f32; 4]);

impl Rgba {
    pub(crate) const CLEAR: Rgba = Rgba([0.0; 4]);

    /// An opaque colour from sRGB bytes.
    pub(crate) fn opaque(srgb: [u8; 3]) -> Self {
        let [r, g, b] = srgb.map(decode);
        Rgba([r, g, b, 1.0])
    }

    /// The colour under another light; alpha stays.
    pub(crate) fn times(self, light: f32) -> Self {
        let [r, g, b, a] = self.0;
        Rgba([r * light, g * light, b * light, a])
    }

    /// This colour with `over` laid upon it at `opacity`.
    pub(crate) fn under(self, over: Rgba, opacity: f32) -> Self {
        let keep = 1.0 - opacity * over.0[3];
        Rgba(std::array::from_fn(|k| self.0[k] * keep + over.0[k] * opacity))
    }

    pub(crate) fn plus(self, other: Rgba) -> Self {
        Rgba(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }
}

/// Four sRGB bytes, alpha not multiplied, of the mean of `n` colours whose sum is given.
pub(crate) fn to_srgb(sum: Rgba, n: f32) -> [u8; 4] {
    let [r, g, b, a] = sum.0;
    if a <= 0.0 {
        return [0; 4];
    }
    let alpha = (a / n * 255.0).round().clamp(0.0, 255.0) as u8;
    let [r, g, b] = [r, g, b].map(|c| encode(c / a));
    [r, g, b, alpha]
}

/// sRGB byte to linear light (IEC 61966-2-1).
fn decode(byte: u8) -> f32 {
    static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
        std::array::from_fn(|byte| {
            let c = byte as f32 / 255.0;
            if c <= 0.04045 {
                c / 12.92
            } else {
                ((c + 0.055) / 1.055).powf(2.4)
            }
        })
    });
    LINEAR[usize::from(byte)]
}

/// Linear light to an sRGB byte.
fn encode(linear: f32) -> u8 {
    let c = linear.clamp(0.0, 1.0);
    let c = if c <= 0.003_130_8 {
        c * 12.92
    } else {
        1.055 * c.powf(1.0 / 2.4) - 0.055
    };
    (c * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_the_way_there_and_back() {
        for byte in 0..=255 {
            assert_eq!(to_srgb(Rgba::opaque([byte; 3]), 1.0), [byte, byte, byte, 255]);
        }
    }

    #[test]
    fn half_covered_white_keeps_its_colour_and_half_its_alpha() {
        let sum = Rgba::opaque([255; 3]).plus(Rgba::CLEAR);
        assert_eq!(to_srgb(sum, 2.0), [255, 255, 255, 128]);
    }

    #[test]
    fn an_opaque_layer_hides_what_is_under_it() {
        let red = Rgba::opaque([200, 0, 0]);
        assert_eq!(Rgba::opaque([0, 99, 0]).under(red, 1.0), red);
        assert_eq!(red.under(Rgba::opaque([1, 2, 3]), 0.0), red);
    }
}
