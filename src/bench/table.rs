//! Tables, printed as text and written as HTML.

use std::io::Write;

use serde::Serialize;

/// Rows of text under a header; the first column holds names.
#[derive(Clone, Debug, Serialize)]
pub struct Table {
    /// What it shows.
    pub title: String,
    /// What to know when reading it.
    pub notes: Vec<String>,
    /// Names of the columns.
    pub header: Vec<String>,
    /// As many cells each as the header has.
    pub rows: Vec<Vec<String>>,
    /// Whether all columns hold words, which stand to the left.
    pub is_words: bool,
}

impl Table {
    /// Without notes and rows.
    pub fn new(title: impl Into<String>, header: &[&str]) -> Self {
        let header = header.iter().map(|&name| name.to_owned()).collect();
        Self { title: title.into(), notes: vec![], header, rows: vec![], is_words: false }
    }

    /// Without notes and rows, of words.
    pub fn of_words(title: impl Into<String>, header: &[&str]) -> Self {
        Self { is_words: true, ..Self::new(title, header) }
    }

    /// Prints it on the standard output; that nobody reads it is no error.
    pub fn print(&self) {
        let _ = std::io::stdout().lock().write_all(self.text().as_bytes());
    }

    /// As text, columns aligned.
    pub fn text(&self) -> String {
        let mut text = format!("\n{}\n", self.title);
        self.notes.iter().for_each(|note| text += &format!("  {note}\n"));
        let lines = || std::iter::once(&self.header).chain(&self.rows);
        let length = |cell: &String| cell.chars().count();
        let widths: Vec<usize> =
            (0..self.header.len()).map(|i| lines().map(|line| length(&line[i])).max().unwrap_or(0)).collect();
        for line in lines() {
            let cells = line.iter().zip(&widths).enumerate();
            // Names to the left, numbers to the right.
            let is_left = |i: usize| i == 0 || self.is_words;
            let padded = cells.map(
                |(i, (cell, &width))| {
                    if is_left(i) { format!("{cell:width$}") } else { format!("{cell:>width$}") }
                },
            );
            text += &format!("  {}\n", padded.collect::<Vec<_>>().join("  "));
        }
        text
    }

    /// As HTML.
    pub fn html(&self) -> String {
        let line = |tag: &str, cells: &[String]| {
            let cells: String = cells.iter().map(|cell| format!("<{tag}>{}</{tag}>", escape(cell))).collect();
            format!("<tr>{cells}</tr>\n")
        };
        let notes: String = self.notes.iter().map(|note| format!("<p>{}</p>\n", escape(note))).collect();
        let rows: String = self.rows.iter().map(|row| line("td", row)).collect();
        format!(
            "<h3>{}</h3>\n{notes}<div class=\"wide\"><table{}>\n{}{rows}</table></div>\n",
            escape(&self.title),
            if self.is_words { " class=\"words\"" } else { "" },
            line("th", &self.header)
        )
    }
}

/// Text as it must be written in HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
