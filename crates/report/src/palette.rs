//! Colours: one list for figures, page and pictures, in a light and a dark variant.
//!
//! Tasks are told apart by colour and by shape, since the least distance between two of the colours as seen by
//! blue-blind eyes is small. Every colour of a task reaches 3 : 1 against its background.

/// Text.
pub const INK: &str = "#1a1d21";
/// Second-rank text, axes.
pub const MUTED: &str = "#5a6270";
/// Grid lines and borders.
pub const RULE: &str = "#d5d9de";
/// Bars that mean no task in particular.
pub const ACCENT: &str = "#3b6ea5";
/// Text on a surface of [`ACCENT`].
pub const ON_ACCENT: &str = "#fffffe";
/// Marks of rejected things.
pub const REJECTED: &str = "#a8aeb8";
/// The page's background.
pub const PAPER: &str = "#ffffff";

/// Colours of the tasks on white, in the order of their states; the fourth is for anything beyond three.
pub const TASKS: [&str; 4] = ["#0072b2", "#d55e00", "#009e73", "#8a5a83"];
/// One shape a task, in the same order.
pub const TASK_SHAPES: [&str; 4] = ["●", "■", "▲", "◆"];

/// Each colour above with its name as a CSS variable and its variant on a dark background.
const THEME: [(&str, &str, &str); 11] = [
    ("ink", INK, "#e6e8eb"),
    ("muted", MUTED, "#9aa3af"),
    ("rule", RULE, "#363b42"),
    ("accent", ACCENT, "#7fb0e0"),
    ("on-accent", ON_ACCENT, "#14171a"),
    ("rejected", REJECTED, "#6b7480"),
    ("paper", PAPER, "#14171a"),
    ("task-0", TASKS[0], "#56b4e9"),
    ("task-1", TASKS[1], "#e69f00"),
    ("task-2", TASKS[2], "#009e73"),
    ("task-3", TASKS[3], "#cc79a7"),
];

/// Which of the task colours the task at `task_idx` has.
pub fn task_color(task_idx: usize) -> &'static str {
    TASKS[task_idx.min(TASKS.len() - 1)]
}

/// The shape of the task at `task_idx`.
pub fn task_shape(task_idx: usize) -> &'static str {
    TASK_SHAPES[task_idx.min(TASK_SHAPES.len() - 1)]
}

/// The CSS that defines the colours as variables, for light, dark, and print.
pub(crate) fn css_variables() -> String {
    let list = |dark: bool| -> String {
        THEME
            .iter()
            .map(|(name, l, d)| format!("--{name}:{};", if dark { d } else { l }))
            .collect()
    };
    format!(
        ":root{{color-scheme:light dark;{}}}@media screen and (prefers-color-scheme:dark){{:root{{{}}}}}",
        list(false),
        list(true)
    )
}

/// A figure's SVG with each colour of the list replaced by its CSS variable, so that the page's theme recolours it.
pub(crate) fn follow_theme(svg: &str) -> String {
    THEME.iter().fold(svg.to_owned(), |svg, (name, light, _)| {
        svg.replace(&format!("\"{light}\""), &format!("\"var(--{name},{light})\""))
    })
}

/// Cividis, ten even steps from low to high.
pub const CIVIDIS: [[u8; 3]; 10] = [
    [0x00, 0x22, 0x4e],
    [0x12, 0x35, 0x70],
    [0x3b, 0x49, 0x6c],
    [0x57, 0x5d, 0x6d],
    [0x70, 0x71, 0x73],
    [0x8a, 0x86, 0x78],
    [0xa5, 0x9c, 0x74],
    [0xc3, 0xb3, 0x69],
    [0xe1, 0xcc, 0x55],
    [0xfe, 0xe8, 0x38],
];

/// A colour of [`CIVIDIS`] for `t` in [0, 1]; outside is clamped, NaN counts as 0.
pub fn cividis(t: f64) -> [u8; 3] {
    let position = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) } * (CIVIDIS.len() - 1) as f64;
    let low = (position.floor() as usize).min(CIVIDIS.len() - 2);
    let part = position - low as f64;
    std::array::from_fn(|k| {
        let (a, b) = (f64::from(CIVIDIS[low][k]), f64::from(CIVIDIS[low + 1][k]));
        (a + (b - a) * part).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance and contrast as WCAG 2 defines them.
    fn contrast(a: &str, b: &str) -> f64 {
        let luminance = |hex: &str| -> f64 {
            let channel = |at: usize| {
                let c = f64::from(u8::from_str_radix(&hex[at..at + 2], 16).unwrap()) / 255.0;
                if c <= 0.04045 {
                    c / 12.92
                } else {
                    ((c + 0.055) / 1.055).powf(2.4)
                }
            };
            0.2126 * channel(1) + 0.7152 * channel(3) + 0.0722 * channel(5)
        };
        let (high, low) = (luminance(a).max(luminance(b)), luminance(a).min(luminance(b)));
        (high + 0.05) / (low + 0.05)
    }

    #[test]
    fn text_reaches_four_and_a_half_and_tasks_three_in_both_themes() {
        let (_, light_paper, dark_paper) = THEME[6];
        for (name, light, dark) in THEME {
            let least = match name {
                "ink" | "muted" => 4.5,
                "accent" => 3.0,
                n if n.starts_with("task") => 3.0,
                _ => continue,
            };
            assert!(contrast(light, light_paper) >= least, "{name} light");
            assert!(contrast(dark, dark_paper) >= least, "{name} dark");
        }
    }

    #[test]
    fn colours_follow_the_theme_only_where_they_are_whole_attributes() {
        assert_eq!(
            follow_theme("fill=\"#1a1d21\" d=\"#1a1d21x\""),
            "fill=\"var(--ink,#1a1d21)\" d=\"#1a1d21x\""
        );
    }

    #[test]
    fn cividis_meets_its_ends_and_clamps() {
        assert_eq!(cividis(-3.0), CIVIDIS[0]);
        assert_eq!(cividis(f64::NAN), CIVIDIS[0]);
        assert_eq!(cividis(1.0), CIVIDIS[9]);
        assert_eq!(cividis(7.0), CIVIDIS[9]);
        assert_eq!(cividis(4.0 / 9.0), CIVIDIS[4]);
    }
}
