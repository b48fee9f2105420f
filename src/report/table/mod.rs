//! A table as plain data, with three writers: for the terminal, in Markdown and in HTML.
//!
//! The maker of a table states its content once; each writer decides how it looks. The tables of a result are made in
//! [`tables`](super::tables).

mod html;
mod markdown;
mod terminal;

pub use html::signs;
pub use markdown::{escaped, left_out};

/// Largest number of rows that are written to the terminal and in Markdown. More would not be read, and GitHub takes at
/// most 1 MiB.
pub const MOST_ROWS: usize = 100;

/// A table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    pub title: String,
    pub columns: Vec<TableColumn>,
    /// Each row has a cell for each column.
    pub rows: Vec<Vec<Cell>>,
    /// The meaning of the columns; may be empty.
    pub note: String,
    /// Whether the marks of the cells are drawn about 0. Otherwise they are shares, from 0 to 1.
    pub about_zero: bool,
}

/// The heading of a column.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TableColumn {
    pub heading: String,
    /// The unit of the cells, if the cells do not state it themselves.
    pub unit: &'static str,
    /// Whether the cells are names or words, which are aligned to the left. Numbers are aligned to the right.
    pub is_words: bool,
    /// The controller of the column, if the columns are to be compared.
    pub controller: Option<usize>,
}

/// A cell. All writers write its text.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cell {
    pub text: String,
    pub mark: Option<CellMark>,
    /// The controller that is named in the cell. It has a colour if the writer has colours.
    pub controller: Option<usize>,
}

/// The value of a cell and its interval, for a writer that can draw. The marks of a row are drawn one below the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellMark {
    pub at: f64,
    pub ci: Option<[f64; 2]>,
    /// The controller whose colour the mark has.
    pub controller: Option<usize>,
}

impl Table {
    /// An empty table with these columns.
    pub fn new(title: impl Into<String>, columns: impl IntoIterator<Item = TableColumn>) -> Self {
        Self {
            title: title.into(),
            columns: columns.into_iter().collect(),
            ..Self::default()
        }
    }

    pub fn with_note(self, note: impl Into<String>) -> Self {
        Self {
            note: note.into(),
            ..self
        }
    }

    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// The table with rows and columns exchanged. The texts of the first column become the headings.
    fn turned(&self) -> Self {
        let corner = self.columns.iter().take(1).cloned();
        let headings = self.rows.iter().map(|row| number(&row[0].text));
        let mut turned = Self::new(&self.title, corner.chain(headings)).with_note(&self.note);
        for (i, column) in self.columns.iter().enumerate().skip(1) {
            let name = Cell {
                text: column.text(),
                mark: None,
                controller: column.controller,
            };
            turned.row(std::iter::once(name).chain(self.rows.iter().map(|row| row[i].clone())));
        }
        turned
    }
}

impl TableColumn {
    /// The heading with its unit.
    fn text(&self) -> String {
        let unit = if self.unit.is_empty() {
            String::new()
        } else {
            format!(" [{}]", self.unit)
        };
        format!("{}{unit}", self.heading)
    }

    pub fn in_unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }
}

/// A column of words.
pub fn words(heading: impl Into<String>) -> TableColumn {
    TableColumn {
        heading: heading.into(),
        is_words: true,
        ..TableColumn::default()
    }
}

/// A column of numbers.
pub fn number(heading: impl Into<String>) -> TableColumn {
    TableColumn {
        heading: heading.into(),
        ..TableColumn::default()
    }
}

/// A column of words, and a column of numbers for each of the other headings.
pub fn headings<const N: usize>(
    first: &str,
    others: [&str; N],
) -> impl Iterator<Item = TableColumn> {
    std::iter::once(words(first)).chain(others.map(number))
}

/// A cell with nothing but a text.
pub fn cell(text: impl ToString) -> Cell {
    Cell {
        text: text.to_string(),
        ..Cell::default()
    }
}

/// A row with nothing but texts.
pub fn texts<const N: usize>(texts: [String; N]) -> impl Iterator<Item = Cell> {
    texts.into_iter().map(cell)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two controllers, one with a name that each writer has to escape.
    pub(super) fn rates() -> Table {
        let mut table = Table::new("Rates", headings("controller", ["recovered", "rate"]))
            .with_note("At 95 %, -1 to 1.");
        for (i, name) in ["hold", "<b>|x_"].into_iter().enumerate() {
            let mark = Some(CellMark {
                at: 0.5,
                ci: Some([0.4, 0.6]),
                controller: Some(i),
            });
            let name = Cell {
                controller: Some(i),
                ..cell(name)
            };
            table.row([
                name,
                cell("1/2"),
                Cell {
                    mark,
                    ..cell("-50.0 %")
                },
            ]);
        }
        table.columns[2].unit = "m/s";
        table
    }

    /// A table of so many controllers side by side.
    pub(super) fn beside(controllers: usize) -> Table {
        let columns = (0..controllers).map(|controller| TableColumn {
            controller: Some(controller),
            ..number(format!("set{controller}"))
        });
        let mut table = Table::new("", std::iter::once(words("lost")).chain(columns));
        for cause in ["legs met", "slipped"] {
            table.row(std::iter::once(cell(cause)).chain((0..controllers).map(cell)));
        }
        table
    }
}
