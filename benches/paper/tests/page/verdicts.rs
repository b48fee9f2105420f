//! The verdicts of `standfast-paper page`, each as it was decided by hand.

use super::{figure, page, runs};
use std::collections::HashMap;

/// The claims of each figure in the order of the page, each by some of its words and by its verdict: `+` agrees, `-`
/// differs, `?` is open.
const VERDICTS: [(&str, &[&str]); 11] = [
    (
        "3",
        &[
            "+inclusion relation",
            "+are ordered",
            "+choosing maximum index",
            "-In general",
            "?nor their k",
        ],
    ),
    (
        "4",
        &[
            "?steps the right foot forward",
            "?origin is located",
            "-S_max(M_Z) online as follows",
            "+enlarge",
        ],
    ),
    (
        "5",
        &[
            "+recalculate",
            "?at the landing",
            "?Relaxation method",
            "-motion is generated",
            "+applied again",
        ],
    ),
    (
        "6",
        &[
            "?the arrow shown in (A)",
            "-the left foot is chosen",
            "?eq. 29",
            "?define the ZMP error",
            "?semi-ellipsoid",
        ],
    ),
    (
        "7",
        &[
            "+Number of joints",
            "?Weight",
            "?Height",
            "?initial foot placement",
        ],
    ),
    (
        "8",
        &[
            "+backward stepping",
            "?was detected",
            "?right foot",
            "?[0.03 0.685 0]",
            "?[−0.03 0 0]",
            "?the COM moves",
        ],
    ),
    (
        "9",
        &[
            "+after foot landing",
            "+after foot landing",
            "-after foot landing",
            "?curves",
        ],
    ),
    (
        "10",
        &[
            "?Z2-500N",
            "?two wires",
            "-unify",
            "+appropriate",
            "?nor a trace",
        ],
    ),
    (
        "12",
        &[
            "+steps forward",
            "?The right foot",
            "+appropriate",
            "-stride",
            "+In order to avoid falling",
            "?how hard",
        ],
    ),
    (
        "13",
        &[
            "+right foot",
            "+backward right",
            "+yaw",
            "-stride",
            "+avoid falling",
            "?towards where",
            "?how hard",
        ],
    ),
    (
        "14",
        &[
            "+in y-axis",
            "?This was because",
            "+COG to the origin",
            "?stay on the ground",
            "?Sect. VII",
            "?curves",
        ],
    ),
];

#[test]
fn every_verdict_is_the_one_that_was_thought_over() {
    let page = page();
    // Quotation marks are for the paper's words, which have a place in it. Three claims are about the update time.
    let (mut claims, mut quotes) = (3, 2);
    for (number, pinned) in VERDICTS {
        let told = figure(number)["claims"].as_array().unwrap();
        assert_eq!(told.len(), pinned.len(), "Fig. {number}");
        for (claim, pinned) in told.iter().zip(pinned) {
            let (verdict, words) = pinned.split_at(1);
            assert_eq!(
                claim["verdict"],
                HashMap::from([("+", "agrees"), ("-", "differs"), ("?", "open")])[verdict]
            );
            let said = format!("{} {}", claim["paper"], claim["place"]);
            assert!(said.contains(words), "Fig. {number}: {words}: {said}");
            claims += 1;
            quotes += usize::from(claim["place"].is_string());
        }
    }
    assert_eq!(page.matches("<p class=\"said\">").count(), claims);
    assert_eq!(page.matches("<p class=\"said\"><q>").count(), quotes);
    assert_eq!(
        page.matches("</q> (Sect. ").count() + page.matches("</q> (Fig. ").count(),
        quotes
    );
    assert!(quotes < claims && quotes > 15, "{quotes} of {claims}");
}

/// At the top of the page and in the table of the command.
#[test]
fn verdicts_are_counted() {
    let page = page();
    let (contents, _) = page.split_once("</nav>").unwrap();
    // Of the update time one agrees and two are open.
    let all: Vec<&str> = VERDICTS
        .iter()
        .flat_map(|(_, pinned)| *pinned)
        .copied()
        .chain(["+", "?", "?"])
        .collect();
    let [agree, differ, open] =
        ["+", "-", "?"].map(|sign| all.iter().filter(|claim| claim.starts_with(sign)).count());
    let total = [
        format!("{agree} agree"),
        format!("{differ} differ"),
        format!("{open} open"),
    ];
    let line = contents
        .lines()
        .find(|line| line.contains("class=\"total\""))
        .unwrap();
    assert!(
        line.contains(&format!("<b>{} statements:</b>", all.len())),
        "{line}"
    );
    assert!(
        total
            .iter()
            .all(|words| line.contains(&format!(">{words}</span>"))),
        "{line}"
    );
    assert!(
        runs().table.contains(&format!("{} statements", all.len()))
            && runs().table.contains(&total.join(", "))
    );
    for (number, pinned) in VERDICTS {
        let count = |verdict: char| {
            pinned
                .iter()
                .filter(|claim| claim.starts_with(verdict))
                .count()
        };
        let plural = |n: usize| if n == 1 { "s" } else { "" };
        let [agree, differ, open] = ['+', '-', '?'].map(count);
        let told = [
            (agree, format!("{agree} agree{}", plural(agree))),
            (differ, format!("{differ} differ{}", plural(differ))),
            (open, format!("{open} open")),
        ];
        let told: Vec<String> = told
            .into_iter()
            .filter(|(n, _)| *n > 0)
            .map(|(_, words)| words)
            .collect();
        let line = contents
            .lines()
            .find(|line| line.contains(&format!("href=\"#fig{number}\"")))
            .unwrap();
        for words in &told {
            assert!(
                line.contains(&format!(">{words}</span>")),
                "{words}: {line}"
            );
        }
        assert_eq!(line.matches("class=\"badge").count(), told.len(), "{line}");
        let row = runs()
            .table
            .lines()
            .find(|line| line.starts_with(&format!("Fig. {number} ")))
            .unwrap();
        assert!(row.ends_with(&told.join(", ")), "{row}");
    }
    // Before them, what was found in all; on the page numbers stay with their units.
    let contents = contents.replace('\u{a0}', " ");
    let found = runs().json["found"].as_array().unwrap();
    assert_eq!(found.len(), 3);
    for (sentence, told) in found.iter().zip(["0.88 s", "3.6 N s", "17 mm"]) {
        let sentence = sentence.as_str().unwrap();
        assert!(
            sentence.contains(told) && contents.contains(sentence),
            "{sentence}"
        );
    }
    assert!(
        contents.contains("1 agrees</span> <span class=\"badge open\">2 open</span></li>"),
        "the update time"
    );
}
