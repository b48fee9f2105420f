//! The verdicts of `standfast paper`, each as it was thought over.

use super::{FIGURES, figure, page, runs};

/// Each claim by the first words that tell it from others, in the order of the page.
const VERDICTS: [(&str, &str, &str); 52] = [
    ("3", "Suppose that the state feedback gains … are de", "agrees"),
    ("3", "the sets … are ordered according to the conver", "agrees"),
    ("3", "In the switching control, the performance is i", "agrees"),
    ("3", "In general, the maximal CPI set becomes small ", "differs"),
    ("3", "The paper prints neither its gains nor their k", "open"),
    ("4", "the robot steps the right foot forward", "open"),
    ("4", "After the foot landing, the control coordinate", "open"),
    ("4", "Because the matrix Φ has been already calculat", "differs"),
    ("4", "it is necessary for the robot to step and enla", "agrees"),
    ("5", "As the stepping necessity is detected, a stepp", "agrees"),
    ("5", "The paper does not say whether the state at th", "open"),
    ("5", "a stepping motion is generated with the Bounda", "open"),
    ("5", "As the stepping necessity is detected, a stepp", "differs"),
    ("5", "the switching control is applied again", "agrees"),
    ("6", "When d is given by the arrow shown in (A) of F", "open"),
    ("6", "if ‖ΔL_max‖ ≥ ‖ΔR_max‖, the left foot is chose", "differs"),
    ("6", "α of eq. 29 and a, b, y of eq. 27 and 28 are n", "open"),
    ("6", "The paper does not define the ZMP error Δp_Z.", "open"),
    ("6", "we set motion range of the right foot D_L by a", "open"),
    ("7", "Number of joints : 20 (4 at each arms, 6 at ea", "agrees"),
    ("7", "Weight : 8.0[kg]", "open"),
    ("7", "Height : 54[mm]", "open"),
    ("7", "The initial foot placement is in the picture o", "open"),
    ("8", "The stepping necessity was detected and a back", "agrees"),
    ("8", "The stepping necessity was detected", "open"),
    ("8", "The right foot was chosen as swinging foot bas", "open"),
    ("8", "we set ZMP error to be Δp_Z = [0.03 0.685 0]ᵀ ", "open"),
    ("8", "we set ZMP error to be Δp_Z = [−0.03 0 0]ᵀ ass", "open"),
    ("8", "The paper does not say how the COM moves as th", "open"),
    ("9", "It is apparent that the state is controlled by", "agrees"),
    ("9", "It is apparent that the state is controlled by", "agrees"),
    ("9", "It is apparent that the state is controlled by", "differs"),
    ("9", "The values of the curves are in the paper's pi", "open"),
    ("12", "a disturbance was imposed from backward and th", "agrees"),
    ("12", "The right foot is chosen as swinging foot.", "open"),
    ("12", "It is verified that the robot steps in the app", "agrees"),
    ("12", "Then, we calculate the stride of step as follo", "differs"),
    ("12", "In order to avoid falling, it is necessary for", "agrees"),
    ("12", "The paper does not print how hard it pushed.", "open"),
    ("13", "disturbance was imposed from diagonally forwar", "agrees"),
    ("13", "the robot stepped diagonally backward right.", "agrees"),
    ("13", "it was seen that the robot rotated around the ", "agrees"),
    ("13", "Then, we calculate the stride of step as follo", "differs"),
    ("13", "In order to avoid falling, it is necessary for", "agrees"),
    ("13", "The paper does not print towards where it push", "open"),
    ("13", "The paper does not print how hard it pushed.", "open"),
    ("14", "ZMP was not manipulated as planned, especially", "agrees"),
    ("14", "This was because ZMP was not manipulated as pl", "open"),
    ("14", "the main focus of the control is set as the re", "agrees"),
    ("14", "The paper does not say whether the soles stay ", "open"),
    ("14", "In this paper, compensation or stabilizing con", "open"),
    ("14", "The values of the curves are in the paper's pi", "open"),
];

#[test]
fn every_verdict_is_the_one_that_was_thought_over() {
    let mut told = Vec::new();
    for number in FIGURES {
        for claim in figure(number)["claims"].as_array().unwrap() {
            told.push((number, claim["paper"].as_str().unwrap(), claim["verdict"].as_str().unwrap()));
        }
    }
    assert_eq!(told.len(), VERDICTS.len());
    for ((number, paper, verdict), pinned) in told.iter().zip(VERDICTS) {
        assert!(
            (*number, *verdict) == (pinned.0, pinned.2) && paper.starts_with(pinned.1),
            "{number}: {paper}: {verdict}"
        );
    }
    // Quotation marks are for the paper's words, and these have a place.
    let (page, claims) = (page(), told.len() + 3);
    assert_eq!(page.matches("<p class=\"said\">").count(), claims);
    let quotes = page.matches("<p class=\"said\"><q>").count();
    assert_eq!(page.matches("</q> (Sect. ").count() + page.matches("</q> (Fig. ").count(), quotes);
    assert!(quotes < claims && quotes > 15, "{quotes} of {claims}");
}

/// At the top of the page and in the table of the command.
#[test]
fn verdicts_are_counted() {
    let page = page();
    let (contents, _) = page.split_once("</nav>").unwrap();
    for number in FIGURES {
        let count = |verdict: &str| VERDICTS.iter().filter(|pinned| pinned.0 == number && pinned.2 == verdict).count();
        let plural = |n: usize| if n == 1 { "s" } else { "" };
        let [agree, differ, open] = ["agrees", "differs", "open"].map(count);
        let told = [
            (agree, format!("{agree} agree{}", plural(agree))),
            (differ, format!("{differ} differ{}", plural(differ))),
            (open, format!("{open} open")),
        ];
        let told: Vec<String> = told.into_iter().filter(|(n, _)| *n > 0).map(|(_, words)| words).collect();
        let line = contents.lines().find(|line| line.contains(&format!("href=\"#fig{number}\""))).unwrap();
        for words in &told {
            assert!(line.contains(&format!(">{words}</span>")), "{words}: {line}");
        }
        assert_eq!(line.matches("class=\"badge").count(), told.len(), "{line}");
        let row = runs().table.lines().find(|line| line.starts_with(&format!("Fig. {number} "))).unwrap();
        assert!(row.ends_with(&told.join(", ")), "{row}");
    }
    assert!(contents.contains("1 agrees</span> <span class=\"badge open\">2 open</span></li>"), "the update time");
}
