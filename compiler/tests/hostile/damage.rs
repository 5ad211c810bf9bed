//! Damage to texts.

/// Random choices from a seed: splitmix64 (Steele, Lea and Flood 2014).
pub(crate) struct Random(u64);

impl Random {
    /// The choices of the input with that number.
    pub(crate) fn new(seed: u64, number: u64) -> Random {
        let mut random = Random(seed.wrapping_mul(0xd1b5_4a32_d192_ed03) ^ number);
        random.next();
        random
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `n`, which is not 0.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    pub(crate) fn bytes(&mut self, n: usize) -> Vec<u8> {
        (0..n).map(|_| self.next() as u8).collect()
    }

    fn pick<'t>(&mut self, of: &[&'t str]) -> &'t str {
        of[self.below(of.len())]
    }
}

/// The kind of a token, so that another one of this kind can replace it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Name,
    Number,
    Space,
    Sign,
}

fn kind(c: char) -> Kind {
    match c {
        _ if c.is_ascii_digit() => Kind::Number,
        _ if c.is_alphanumeric() || c == '_' => Kind::Name,
        _ if c.is_whitespace() => Kind::Space,
        _ => Kind::Sign,
    }
}

/// Splits a text where a token may begin or end: names, numbers with their units, spaces, signs.
pub(crate) fn pieces(text: &str) -> Vec<String> {
    let mut pieces: Vec<String> = Vec::new();
    let mut last = None;
    for c in text.chars() {
        let kind = kind(c);
        let goes_on = match (last, kind) {
            (Some(Kind::Name | Kind::Number), Kind::Name | Kind::Number) | (Some(Kind::Space), Kind::Space) => true,
            (Some(Kind::Sign), Kind::Sign) => {
                let before = pieces.last().map_or("", String::as_str);
                matches!(
                    (before, c),
                    ("." | "|", '.' | '|') | ("=" | "<" | ">" | "!", '=') | ("-", '>') | ("/" | "//", '/')
                )
            }
            _ => false,
        };
        match pieces.last_mut() {
            Some(piece) if goes_on => piece.push(c),
            _ => {
                pieces.push(c.to_string());
                last = Some(kind);
            }
        }
    }
    pieces
}

fn kind_of(piece: &str) -> Kind {
    piece.chars().next().map_or(Kind::Space, kind)
}

const NUMBERS: [&str; 21] = [
    "0",
    "1",
    "2",
    "-1",
    "0.5",
    "1e308",
    "1e999",
    "1e-320",
    "0.0",
    "3mm",
    "90deg",
    "1turn",
    "64",
    "65",
    "4096",
    "100000",
    "1000000000",
    "2147483648",
    "9223372036854775807",
    "9223372036854775808",
    "99999999999999999999999999",
];

const SIGNS: [&str; 26] = [
    "+", "-", "*", "/", "%", "^", "==", "!=", "<", "<=", ">", ">=", "..", "(", ")", "[", "]", "{", "}", "'", ".", ",",
    ";", ":", "|", "=",
];

/// Groups of operators that may replace each other.
const OPERATORS: [&[&str]; 3] =
    [&["+", "-", "*", "/", "%", "^"], &["==", "!=", "<", "<=", ">", ">="], &["(", ")", "[", "]", "{", "}"]];

const KEYWORDS: [&str; 19] = [
    "let",
    "fn",
    "deriv",
    "model",
    "param",
    "input",
    "part",
    "require",
    "for",
    "in",
    "if",
    "else",
    "true",
    "false",
    "and",
    "or",
    "not",
    "use",
    "tolerance",
];

const WORDS: [&str; 25] = [
    "fold", "sum", "len", "stop", "floor", "each", "sqrt", "sin", "min", "map", "norm", "revolve", "tube", "bezier",
    "place", "pi", "real", "int", "length", "surface", "point3", "_", "abs", "atan2", "x",
];

/// Beginnings and ends that are put around tokens, many times.
const NESTS: [(&str, &str); 14] = [
    ("(", ")"),
    ("[", "]"),
    ("{ ", " }"),
    ("-", ""),
    ("not ", ""),
    ("|x| ", ""),
    ("", "'"),
    ("1 + ", ""),
    ("2 ^ ", ""),
    ("if a > 0 { ", " } else { 0 }"),
    ("f(", ")"),
    ("{a: ", "}"),
    ("for i in 0..3 { ", " }"),
    ("", ".x"),
];

/// A damaged text of the corpus.
pub(crate) fn input(corpus: &[String], random: &mut Random) -> String {
    let mut text = if random.below(4) == 0 {
        let length = random.below(250);
        crate::generate::script(&random.bytes(length))
    } else {
        corpus[random.below(corpus.len())].clone()
    };
    // Whole texts are joined, so that their names collide.
    if random.below(16) == 0 {
        text.push_str(&corpus[random.below(corpus.len())]);
    }
    match random.below(16) {
        0 => return bytes(text.into_bytes(), random),
        1 => text = lines(&text, corpus, random),
        _ => {}
    }
    let mut tokens = pieces(&text);
    // Half of all inputs are damaged in one place only: they reach the latest stages.
    let times = 1 + random.below(2) * random.below(2) * random.below(5) + random.below(2) * random.below(2);
    for _ in 0..times {
        if tokens.is_empty() {
            break;
        }
        if random.below(4) > 0 {
            of_its_kind(&mut tokens, random);
        } else {
            token(&mut tokens, corpus, random);
        }
    }
    tokens.concat()
}

fn bytes(mut text: Vec<u8>, random: &mut Random) -> String {
    for _ in 0..1 + random.below(6) {
        if text.is_empty() {
            break;
        }
        let at = random.below(text.len());
        match random.below(5) {
            0 => text[at] ^= 1 << random.below(8),
            1 => text[at] = random.below(256) as u8,
            2 => {
                let n = 1 + random.below(8);
                let noise = random.bytes(n);
                drop(text.splice(at..at, noise));
            }
            3 => {
                let to = (at + 1 + random.below(40)).min(text.len());
                drop(text.drain(at..to));
            }
            _ => text.truncate(at),
        }
    }
    String::from_utf8_lossy(&text).into_owned()
}

fn lines(text: &str, corpus: &[String], random: &mut Random) -> String {
    let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
    let other = &corpus[random.below(corpus.len())];
    let others: Vec<&str> = other.split_inclusive('\n').collect();
    let at = random.below(lines.len());
    match random.below(4) {
        0 => drop(lines.remove(at)),
        1 => {
            let to = random.below(lines.len());
            lines.swap(at, to);
        }
        2 => {
            let line = lines[at];
            lines.insert(at, line);
        }
        _ => {
            let from = random.below(others.len());
            let to = (from + 1 + random.below(6)).min(others.len());
            drop(lines.splice(at..at, others[from..to].iter().copied()));
        }
    }
    lines.concat()
}

fn token(tokens: &mut Vec<String>, corpus: &[String], random: &mut Random) {
    let at = place(tokens, random);
    match random.below(8) {
        0 => drop(tokens.remove(at)),
        1 => tokens.insert(at, tokens[at].clone()),
        2 => {
            let to = random.below(tokens.len());
            tokens.swap(at, to);
        }
        3 => {
            let other = pieces(&corpus[random.below(corpus.len())]);
            tokens[at].clone_from(&other[random.below(other.len())]);
        }
        4 => {
            let other = pieces(&corpus[random.below(corpus.len())]);
            let from = random.below(other.len());
            let to = (from + 1 + random.below(30)).min(other.len());
            drop(tokens.splice(at..at, other[from..to].iter().cloned()));
        }
        5 => nest(tokens, at, random),
        6 => {
            let to = (at + 1 + random.below(20)).min(tokens.len());
            drop(tokens.drain(at..to));
        }
        _ => {
            let to = (at + 1 + random.below(20)).min(tokens.len());
            let again = tokens[at..to].to_vec();
            drop(tokens.splice(to..to, again));
        }
    }
}

/// Chooses a token, rarely a space.
fn place(tokens: &[String], random: &mut Random) -> usize {
    let places = [0; 6].map(|_| random.below(tokens.len()));
    let worth = |at: &usize| {
        let token = tokens[*at].as_str();
        kind_of(token) != Kind::Space && !OPERATORS[2].contains(&token)
    };
    places.into_iter().find(worth).unwrap_or(places[0])
}

/// Replaces a token by another one of its kind, mostly one of the same text: the result often still has a meaning.
fn of_its_kind(tokens: &mut [String], random: &mut Random) {
    let at = place(tokens, random);
    let known: &[&str] = match kind_of(&tokens[at]) {
        Kind::Number => &NUMBERS,
        Kind::Space => &["", " ", "\n", "\t", "\u{a0}"],
        Kind::Name if KEYWORDS.contains(&tokens[at].as_str()) && random.below(8) > 0 => return,
        Kind::Name if KEYWORDS.contains(&tokens[at].as_str()) => &KEYWORDS,
        Kind::Name => &WORDS,
        Kind::Sign => match OPERATORS.iter().find(|group| group.contains(&tokens[at].as_str())) {
            Some(group) => group,
            None if random.below(8) > 0 => return,
            None => &SIGNS,
        },
    };
    let same = |t: &&str| match kind_of(&tokens[at]) {
        Kind::Name => kind_of(t) == Kind::Name && !KEYWORDS.contains(t),
        Kind::Sign => known.contains(t),
        kind => kind_of(t) == kind,
    };
    let own: Vec<&str> = tokens.iter().map(String::as_str).filter(same).collect();
    let other = if !own.is_empty() && random.below(3) > 0 { random.pick(&own) } else { random.pick(known) };
    tokens[at] = other.to_owned();
}

/// Wraps some tokens, up to thousands of times.
fn nest(tokens: &mut Vec<String>, at: usize, random: &mut Random) {
    let to = (at + 1 + random.below(8)).min(tokens.len());
    let (open, close) = NESTS[random.below(NESTS.len())];
    let times = [1, 2, 3, 8, 40, 150, 250, 3000][random.below(8)];
    tokens.insert(to, close.repeat(times));
    tokens.insert(at, open.repeat(times));
}
