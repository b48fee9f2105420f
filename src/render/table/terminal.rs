//! Tables on a terminal: all look alike, and are as wide as the terminal or 80 columns.

use super::{MOST_ROWS, Table, left_out};
use crate::render::text::layout::{PLAIN_WIDTH, wrapped};
use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, LineStyle, TableStyle, Width};

/// With more controllers side by side than this, the sets are the rows.
const FEW: usize = 4;

impl Table {
    /// The table, and its note below.
    pub fn text(&self) -> String {
        if self.columns.iter().filter(|column| column.set.is_some()).count() > FEW {
            return self.turned().text();
        }
        let note = match &*(self.note.clone() + &left_out(self.rows.len(), "`summary.json`")) {
            "" => String::new(),
            note => wrapped(" ", note.trim_start()),
        };
        format!("{}\n{note}", self.drawn())
    }

    fn drawn(&self) -> comfy_table::Table {
        let mut drawn = comfy_table::Table::new();
        let rule = TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));
        drawn.load_style(rule).set_content_arrangement(ContentArrangement::Dynamic);
        if !drawn.is_tty() {
            drawn.set_width(PLAIN_WIDTH);
        }
        for row in self.rows.iter().take(MOST_ROWS) {
            drawn.add_row(row.iter().map(|cell| &cell.text));
        }
        // If not all has room, the headings of numbers wrap first, then numbers, and names at last.
        let texts = |i: usize| self.rows.iter().map(move |row| row[i].text.as_str());
        let widest = |i: usize| texts(i).map(|text| text.chars().count()).max().unwrap_or_default();
        let mut headings: Vec<String> = self.columns.iter().map(|column| column.text()).collect();
        let needs = |headings: &[String]| -> usize {
            let width = |heading: &String| heading.lines().map(|line| line.chars().count()).max().unwrap_or_default();
            headings.iter().enumerate().map(|(i, heading)| width(heading).max(widest(i)) + 2).sum::<usize>() - 1
        };
        let room = drawn.width().unwrap_or(PLAIN_WIDTH).into();
        if needs(&headings) > room {
            let numbers = headings.iter_mut().enumerate().filter(|(i, _)| !self.columns[*i].is_words);
            let wide = numbers.filter(|(i, heading)| heading.chars().count() > widest(*i));
            wide.for_each(|(_, heading)| *heading = heading.replace(' ', "\n"));
        }
        let has_room = needs(&headings) <= room;
        // A heading is broken at its spaces, but not within a unit.
        drawn.set_header(headings.iter().map(|heading| heading.replace('\u{a0}', " ")));
        for (i, column) in self.columns.iter().enumerate() {
            let Some(drawn) = drawn.column_mut(i) else { continue };
            drawn.set_padding((1, 0));
            drawn.set_cell_alignment(if column.is_words { CellAlignment::Left } else { CellAlignment::Right });
            if column.is_words && !has_room {
                let words = texts(i).flat_map(|text| text.split(' '));
                let longest = words.map(|word| word.chars().count() as u16 + 1).max().unwrap_or_default();
                let least = Width::Fixed(longest.min(PLAIN_WIDTH / 3));
                drawn.set_constraint(ColumnConstraint::LowerBoundary(least));
            }
        }
        drawn
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{beside, rates};
    use super::*;

    #[test]
    fn numbers_end_at_the_right_and_many_sets_are_rows() {
        let text = rates().text();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], " controller  recovered  rate [m/s]");
        assert_eq!(
            lines[2..],
            [" hold              1/2     -50.0 %", " <b>|x_            1/2     -50.0 %", " At 95 %, -1 to 1."]
        );
        let few = beside(4).text();
        assert!(few.starts_with(" lost      set0  set1  set2  set3\n") && few.lines().count() == 4, "{few}");
        let many = beside(5).text();
        assert!(many.starts_with(" lost  legs met  slipped\n") && many.contains(" set4         4        4"), "{many}");
        let mut long = beside(1);
        long.rows = vec![long.rows[0].clone(); MOST_ROWS + 9];
        assert!(long.text().ends_with(" 9 more rows are in `summary.json`.\n"));
    }
}
