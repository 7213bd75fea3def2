use super::*;

fn ours() -> impl Iterator<Item = &'static File> {
    FILES.iter().filter(|file| !file.path.starts_with("/vendor/"))
}

#[test]
fn the_page_names_no_other_site_and_has_nothing_inline() {
    for File { path, text, .. } in ours() {
        for forbidden in ["http://", "https://", "//cdn", "innerHTML", "eval(", "javascript:", "onclick=\""] {
            assert!(!text.contains(forbidden), "{path} has {forbidden}");
        }
    }
    let [html] = FILES.iter().filter(|file| file.kind == HTML).collect::<Vec<_>>()[..] else {
        panic!("one page")
    };
    assert_eq!(html.text.matches("<script").count(), html.text.matches("<script src=").count());
    assert!(!html.text.contains("<style") && !html.text.contains("style=\""));
}

/// What stands between each of these marks and the next quotation mark.
fn after<'a>(text: &'a str, marks: [&'a str; 2]) -> impl Iterator<Item = &'a str> {
    marks.into_iter().flat_map(|mark| text.split(mark).skip(1)).filter_map(|rest| rest.split('"').next())
}

#[test]
fn every_file_that_the_page_uses_is_there() {
    let known = |path: &str| FILES.iter().any(|file| file.path == format!("/{path}"));
    for File { path, text, .. } in FILES.iter().filter(|file| file.kind == SCRIPT) {
        for name in after(text, [" from \"./", "from\"./"]) {
            let beside =
                if path.starts_with("/vendor/") { format!("vendor/{name}") } else { name.to_owned() };
            assert!(known(&beside), "{path} imports {name}");
        }
    }
    for name in after(FILES[0].text, ["src=\"", "href=\""]).filter(|name| !name.starts_with("data:")) {
        assert!(known(name), "the page uses {name}");
    }
}

#[test]
fn stop_needs_no_other_script() {
    let stop = FILES.iter().find(|file| file.path == "/stop.js").unwrap().text;
    assert!(!stop.contains("import ") && !stop.contains("x-tactus-token"), "{stop}");
    assert!(
        FILES[0].text.contains("id=\"stop\"") && FILES[0].text.contains("<script src=\"stop.js\" defer>")
    );
}

#[test]
fn what_others_wrote_has_its_licence_beside_it() {
    let licences = FILES.iter().find(|file| file.path == "/vendor/LICENCES.txt").unwrap().text;
    for file in FILES.iter().filter(|file| file.path.starts_with("/vendor/") && file.kind != TEXT) {
        let name = file.path.trim_start_matches("/vendor/");
        assert!(licences.contains(name), "{name} is not listed");
    }
    for words in ["The MIT License", "Apache License", "Jason Miller", "Leon Sorokin"] {
        assert!(licences.contains(words), "{words}");
    }
}
