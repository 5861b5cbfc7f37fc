//! The known name that a misspelt word was meant to be.

/// The known name that `word` was most likely meant to be, if any is near.
///
/// A name is near if it begins the other, or if at most a third of the letters are added, left out, changed
/// or swapped. Case, `-`, `_` and spaces don't count.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain = |name: &str| name.to_lowercase().replace(['_', ' '], "-");
    let word = plain(word);
    // The cost of the distance grows with the square of the length; no name is as long as this.
    if word.len() > 100 {
        return None;
    }
    let mut best: Option<(usize, &str)> = None;
    let mut beginning = None;
    for name in known {
        let other = plain(name);
        let distance = strsim::damerau_levenshtein(&word, &other);
        let longest = word.chars().count().max(other.chars().count());
        if distance <= (longest / 3).max(1)
            && distance < longest
            && best.is_none_or(|(least, _)| distance < least)
        {
            best = Some((distance, name));
        }
        let shortest = word.chars().count().min(other.chars().count());
        if shortest >= 3 && (other.starts_with(&word) || word.starts_with(&other)) && beginning.is_none() {
            beginning = Some(name);
        }
    }
    best.map(|(_, name)| name).or(beginning)
}

/// Owner of the names in suggestions.
pub const SCENE: &str = "the scene";

/// "did you mean …?" or a list of the known names; `owner` is `the scene` or another that has such names.
pub fn suggestion(word: &str, known: &[&str], owner: &str, what: &str) -> String {
    match nearest(word, known.iter().copied()) {
        Some(name) => format!("did you mean `{name}`?"),
        None if known.is_empty() => format!("{owner} has no {what}"),
        None => {
            let list = known.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
            format!("{what} of {owner}: {list}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_near() {
        let known = ["shear-modulus", "bulk-modulus", "fibre", "to"];
        assert_eq!(nearest("Shear_Modulus", known), Some("shear-modulus"));
        assert_eq!(nearest("bulk", known), Some("bulk-modulus"));
        assert_eq!(nearest("fiber", known), Some("fibre"));
        assert_eq!(nearest("ot", known), Some("to"));
        assert_eq!(nearest("x", known), None);
        assert_eq!(nearest("density", known), None);
        assert_eq!(nearest("", known), None);
        assert_eq!(nearest(&"x".repeat(100_000), known), None);
    }

    #[test]
    fn names_without_a_near_one_are_listed() {
        assert_eq!(
            suggestion("x", &["tissue", "bone"], SCENE, "laws"),
            "laws of the scene: `tissue`, `bone`"
        );
        assert_eq!(suggestion("x", &[], "the mesh", "cell data"), "the mesh has no cell data");
    }
}
