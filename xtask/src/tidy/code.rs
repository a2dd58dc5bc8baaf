//! The code of a Rust file without comments, texts and tests.

/// Lines of `text` with comments, contents of strings and items under `#[cfg(test)]` blanked, so that line numbers hold.
pub fn code_lines(text: &str) -> Vec<String> {
    without_tests(&without_comments_and_strings(text))
        .lines()
        .map(str::to_owned)
        .collect()
}

fn without_comments_and_strings(text: &str) -> String {
    let chars: Vec<char> = text.chars().collect();
    let mut out = String::with_capacity(text.len());
    let mut i = 0;
    let blank = |c: char| if c == '\n' { '\n' } else { ' ' };
    while i < chars.len() {
        let rest = &chars[i..];
        let after_name = i > 0 && (chars[i - 1].is_alphanumeric() || chars[i - 1] == '_');
        let end = match rest {
            ['/', '/', ..] => i + rest.iter().position(|&c| c == '\n').unwrap_or(rest.len()),
            ['/', '*', ..] => end_of_block_comment(&chars, i),
            ['"', ..] => end_of_string(&chars, i),
            ['r', '"' | '#', ..] if !after_name => end_of_raw_string(&chars, i).unwrap_or(i),
            ['b', 'r', '"' | '#', ..] if !after_name => end_of_raw_string(&chars, i + 1).unwrap_or(i),
            ['\'', '\\', _, ..] => i + 3 + rest[3..].iter().position(|&c| c == '\'').map_or(0, |p| p + 1),
            ['\'', _, '\'', ..] => i + 3,
            _ => i,
        };
        if end == i {
            out.push(chars[i]);
            i += 1;
        } else {
            let end = end.min(chars.len());
            out.extend(chars[i..end].iter().map(|&c| blank(c)));
            i = end;
        }
    }
    out
}

fn end_of_block_comment(chars: &[char], start: usize) -> usize {
    let (mut depth, mut i) = (0, start);
    while i < chars.len() {
        match chars[i..] {
            ['/', '*', ..] => (depth, i) = (depth + 1, i + 2),
            ['*', '/', ..] => (depth, i) = (depth - 1, i + 2),
            _ => i += 1,
        }
        if depth == 0 {
            break;
        }
    }
    i
}

fn end_of_string(chars: &[char], start: usize) -> usize {
    let mut i = start + 1;
    while i < chars.len() && chars[i] != '"' {
        i += if chars[i] == '\\' { 2 } else { 1 };
    }
    i + 1
}

/// End of the raw string whose `r` stands at `start`, or nothing where that is no raw string (`r#type`).
fn end_of_raw_string(chars: &[char], start: usize) -> Option<usize> {
    let hashes = chars[start + 1..].iter().take_while(|&&c| c == '#').count();
    let open = start + 1 + hashes;
    if chars.get(open) != Some(&'"') {
        return None;
    }
    let closes = |i: &usize| {
        chars[*i] == '"' && chars[i + 1..].iter().take(hashes).filter(|c| **c == '#').count() == hashes
    };
    (open + 1..chars.len())
        .find(closes)
        .map(|i| i + 1 + hashes)
        .or(Some(chars.len()))
}

/// Blanks each item after `#[cfg(test)]`, up to its semicolon or closing brace.
fn without_tests(code: &str) -> String {
    const MARK: &str = "#[cfg(test)]";
    let mut out = String::with_capacity(code.len());
    let mut rest = code;
    while let Some(at) = rest.find(MARK) {
        out.push_str(&rest[..at]);
        let item = &rest[at..];
        let (mut depth, mut end) = (0, item.len());
        for (i, c) in item.char_indices().skip(MARK.len()) {
            match c {
                '{' | '(' | '[' => depth += 1,
                '}' | ')' | ']' => depth -= 1,
                _ => {}
            }
            if depth == 0 && (c == ';' || c == '}') {
                end = i + 1;
                break;
            }
        }
        out.extend(item[..end].chars().filter(|&c| c == '\n'));
        rest = &item[end..];
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_strings_and_tests_are_blank_and_lines_stay() {
        let text = "//! std::fs\nlet a = \"std::fs \\\" {\"; // std::env\nlet b = '\"'; let c: &'static str = r#\"dbg!\"#;\n\
                    #[cfg(test)]\nmod tests {\n    fn f() { std::fs::read() }\n}\nfn g() {}\n";
        let code = code_lines(text);
        assert_eq!(code.len(), text.lines().count());
        assert!(
            code.iter()
                .all(|line| !line.contains("std::fs") && !line.contains("dbg!")),
            "{code:?}"
        );
        assert!(code[2].contains("let c: &'static str"), "{code:?}");
        assert_eq!(code[7], "fn g() {}");
    }

    #[test]
    fn a_test_module_in_its_own_file_ends_at_its_semicolon() {
        assert_eq!(
            code_lines("#[cfg(test)]\nmod checks;\nuse std::fs;"),
            ["", "", "use std::fs;"]
        );
    }
}
