//! A picture that the page shows: PNG bytes, its size, and what it says in words.

use maud::{Markup, html};

use crate::ReportError;

/// A PNG with the sentence that stands in for it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// File name without extension under which it also stands beside the page; empty: only in the page.
    pub name: String,
    /// The PNG file's bytes.
    pub png: Vec<u8>,
    /// What the picture shows, in one sentence.
    pub alt: String,
}

impl Picture {
    /// Width and height in pixels, from the PNG's header.
    ///
    /// # Errors
    ///
    /// [`ReportError::NotPng`] where the bytes are no PNG.
    pub fn size(&self) -> Result<(u32, u32), ReportError> {
        let not_png = || ReportError::NotPng {
            picture: self.name.clone(),
            n_bytes: self.png.len(),
        };
        if self.png.len() < 24 || !self.png.starts_with(b"\x89PNG\r\n\x1a\n") || &self.png[12..16] != b"IHDR"
        {
            return Err(not_png());
        }
        let word = |at: usize| u32::from_be_bytes([0, 1, 2, 3].map(|i| self.png[at + i]));
        Ok((word(16), word(20)))
    }

    /// The picture as an `img` with its bytes inside; nothing where it is empty. `css_width` is in CSS pixels, so
    /// that a picture of twice the pixels is sharp on dense screens.
    pub(crate) fn img(&self, css_width: u32) -> Markup {
        let Ok((width, height)) = self.size() else {
            return html! {};
        };
        let css_height = (f64::from(css_width) * f64::from(height) / f64::from(width.max(1))).round() as u32;
        html! {
            img src={ "data:image/png;base64," (base64(&self.png)) } width=(css_width) height=(css_height)
                alt=(self.alt) loading="lazy" decoding="async";
        }
    }

    /// Whether there is nothing to show.
    pub fn is_empty(&self) -> bool {
        self.png.is_empty()
    }
}

/// Base64 with the standard alphabet and padding (RFC 4648, section 4).
pub(crate) fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let bits = chunk.iter().fold(0_u32, |bits, b| bits << 8 | u32::from(*b)) << (8 * (3 - chunk.len()));
        for i in 0..4 {
            let sextet = (bits >> (18 - 6 * i) & 63) as usize;
            text.push(if i <= chunk.len() {
                char::from(ALPHABET[sextet])
            } else {
                '='
            });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_agrees_with_the_vectors_of_rfc_4648() {
        let vectors = ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"];
        for (n, expected) in vectors.iter().enumerate() {
            assert_eq!(base64(&b"foobar"[..n]), *expected);
        }
    }

    #[test]
    fn bytes_that_are_no_png_are_named() {
        let picture = Picture {
            name: "mug".into(),
            png: b"GIF89a".to_vec(),
            alt: String::new(),
        };
        assert_eq!(
            picture.size().unwrap_err().to_string(),
            "picture `mug`: expected a PNG file, found 6 bytes with no PNG header; encode it with `encode_png`"
        );
        assert_eq!(picture.img(10).into_string(), "");
    }
}
