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
/// Shade of cells, at up to [`SHADE_MOST`] of its strength, so that [`INK`] stays readable on it.
pub const SHADE: &str = "#3b6ea4";
/// Largest opacity of [`SHADE`] under text.
pub const SHADE_MOST: f64 = 0.72;
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
    ("shade", SHADE, "#3f74b0"),
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
    let list = |dark: bool| {
        THEME
            .iter()
            .fold(String::new(), |mut css, (name, on_light, on_dark)| {
                let color = if dark { on_dark } else { on_light };
                css.extend(["--", name, ":", color, ";"]);
                css
            })
    };
    let (light, dark) = (list(false), list(true));
    format!(
        ":root{{color-scheme:light dark;{light}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}"
    )
}

/// A figure's SVG with each colour of the list replaced by its CSS variable, so that the page's theme recolours it.
pub(crate) fn follow_theme(svg: &str) -> String {
    THEME.iter().fold(svg.to_owned(), |svg, (name, light, _)| {
        svg.replace(&format!("\"{light}\""), &format!("\"var(--{name},{light})\""))
    })
}

/// Viridis, ten even steps from low to high. Its middle is green, so that a grey object stays visible upon it.
pub const VIRIDIS: [[u8; 3]; 10] = [
    [0x44, 0x01, 0x54],
    [0x48, 0x28, 0x78],
    [0x3e, 0x49, 0x89],
    [0x31, 0x68, 0x8e],
    [0x26, 0x82, 0x8e],
    [0x1f, 0x9e, 0x89],
    [0x35, 0xb7, 0x79],
    [0x6d, 0xcd, 0x59],
    [0xb4, 0xde, 0x2c],
    [0xfd, 0xe7, 0x25],
];

/// A colour of the scale viridis for `t` in [0, 1]; outside is clamped, NaN counts as 0.
pub fn viridis(t: f64) -> [u8; 3] {
    let position = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) } * (VIRIDIS.len() - 1) as f64;
    let low = (position.floor() as usize).min(VIRIDIS.len() - 2);
    let part = position - low as f64;
    std::array::from_fn(|k| {
        let (a, b) = (f64::from(VIRIDIS[low][k]), f64::from(VIRIDIS[low + 1][k]));
        (a + (b - a) * part).round() as u8
    })
}

/// The scale of [`viridis`] as a CSS gradient.
pub(crate) fn css_gradient() -> String {
    let steps = VIRIDIS.map(|[r, g, b]| format!("#{r:02x}{g:02x}{b:02x}"));
    format!("linear-gradient(to right,{})", steps.join(","))
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
    fn text_on_the_darkest_cell_reaches_four_and_a_half() {
        let mixed = |top: &str, ground: &str| {
            let channel = |hex: &str, at: usize| f64::from(u8::from_str_radix(&hex[at..at + 2], 16).unwrap());
            let mix = |at| SHADE_MOST * channel(top, at) + (1.0 - SHADE_MOST) * channel(ground, at);
            format!("#{:02x}{:02x}{:02x}", mix(1) as u8, mix(3) as u8, mix(5) as u8)
        };
        let of = |name: &str| THEME.iter().find(|t| t.0 == name).unwrap();
        let (ink, shade, paper) = (of("ink"), of("shade"), of("paper"));
        assert!(contrast(ink.1, &mixed(shade.1, paper.1)) >= 4.5);
        assert!(contrast(ink.2, &mixed(shade.2, paper.2)) >= 4.5);
    }

    #[test]
    fn colours_follow_the_theme_only_where_they_are_whole_attributes() {
        assert_eq!(
            follow_theme("fill=\"#1a1d21\" d=\"#1a1d21x\""),
            "fill=\"var(--ink,#1a1d21)\" d=\"#1a1d21x\""
        );
    }

    #[test]
    fn viridis_meets_its_ends_and_clamps() {
        assert_eq!(viridis(-3.0), VIRIDIS[0]);
        assert_eq!(viridis(f64::NAN), VIRIDIS[0]);
        assert_eq!(viridis(1.0), VIRIDIS[9]);
        assert_eq!(viridis(7.0), VIRIDIS[9]);
        assert_eq!(viridis(4.0 / 9.0), VIRIDIS[4]);
    }
}
