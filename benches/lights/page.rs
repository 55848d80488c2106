//! All that was printed on one page, with pictures.

use std::path::Path;

use lanternfish::bench::table::{Table, escape};

const STYLE: &str = "body{font:14px sans-serif;margin:2em}table{border-collapse:collapse}\
    td,th{padding:2px 10px;text-align:right;border-bottom:1px solid #ccc}td:first-child,th:first-child{text-align:left}";

/// Writes the page and says so.
pub fn write(path: &Path, about: &[String], tables: &[Table], pictures: &[String]) {
    let about: String = about.iter().map(|line| format!("{}<br>\n", escape(line))).collect();
    let tables: String = tables.iter().map(Table::html).collect();
    let text = format!(
        "<!doctype html>\n<meta charset=\"utf-8\">\n<title>Selecting lights</title>\n<style>{STYLE}</style>\n\
         <h1>Selecting lights</h1>\n<p>{about}</p>\n{tables}{}\n",
        pictures.concat()
    );
    match std::fs::write(path, text) {
        Ok(()) => println!("written: {}", path.display()),
        Err(error) => eprintln!("cannot write {}: {error}", path.display()),
    }
}
