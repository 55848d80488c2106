//! Tables, printed as text and written as HTML.

use serde::Serialize;

#[derive(Serialize)]
pub struct Table {
    pub title: String,
    /// What to know when reading it.
    pub notes: Vec<String>,
    pub header: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Table {
    pub fn new(title: impl Into<String>, header: &[&str]) -> Self {
        let header = header.iter().map(|&name| name.to_owned()).collect();
        Self { title: title.into(), notes: vec![], header, rows: vec![] }
    }

    pub fn print(&self) {
        println!("\n{}", self.title);
        self.notes.iter().for_each(|note| println!("  {note}"));
        let lines = || std::iter::once(&self.header).chain(&self.rows);
        let length = |cell: &String| cell.chars().count();
        let widths: Vec<usize> =
            (0..self.header.len()).map(|i| lines().map(|line| length(&line[i])).max().unwrap_or(0)).collect();
        for line in lines() {
            let cells = line.iter().zip(&widths).enumerate();
            // Names to the left, numbers to the right.
            let padded = cells
                .map(|(i, (cell, &width))| if i == 0 { format!("{cell:width$}") } else { format!("{cell:>width$}") });
            println!("  {}", padded.collect::<Vec<_>>().join("  "));
        }
    }

    pub fn html(&self) -> String {
        let line = |tag: &str, cells: &[String]| {
            let cells: String = cells.iter().map(|cell| format!("<{tag}>{}</{tag}>", escape(cell))).collect();
            format!("<tr>{cells}</tr>\n")
        };
        let notes: String = self.notes.iter().map(|note| format!("<p>{}</p>\n", escape(note))).collect();
        let rows: String = self.rows.iter().map(|row| line("td", row)).collect();
        format!("<h2>{}</h2>\n{notes}<table>\n{}{rows}</table>\n", escape(&self.title), line("th", &self.header))
    }
}

pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
