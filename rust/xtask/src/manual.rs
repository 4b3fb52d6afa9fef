//! `cargo x manual`: docs/manual as pages that a browser shows without a network.

use crate::run::{empty, root, say, target};
use crate::{addon, gui};
use anyhow::{Context, bail};
use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd, html};
use std::path::{Path, PathBuf};

/// The look of all pages: no script, no font of another place.
const STYLE: &str = "body{max-width:46em;margin:2em auto;padding:0 1em;font:16px/1.5 sans-serif;color:#222}\
img{max-width:100%;border:1px solid #ccc}table{border-collapse:collapse}td,th{border:1px solid #ccc;padding:.3em .6em;\
text-align:left;vertical-align:top}pre{background:#f4f4f4;padding:.6em;overflow:auto}em{font-style:normal;background:#eef;\
padding:0 .2em;border-radius:3px}";

/// Takes the pictures anew if wanted, then builds the pages.
pub fn manual(with_pictures: bool) -> anyhow::Result<()> {
    if with_pictures {
        gui::gui(&addon::build()?)?;
        gui::pictures()?;
    }
    let pages = pages()?;
    say(&format!("{}", pages.join("index.html").display()));
    Ok(())
}

/// Builds `target/manual`, a page for each chapter with the pictures beside them, and gives back the folder.
pub fn pages() -> anyhow::Result<PathBuf> {
    let (from, to) = (root().join("docs/manual"), target("manual"));
    empty(&to)?;
    for file in files(&from)? {
        if file.extension().is_some_and(|e| e == "md") {
            let page = page(&std::fs::read_to_string(&file)?).with_context(|| format!("{}", file.display()))?;
            std::fs::write(to.join(file.with_extension("html").file_name().unwrap_or_default()), page)?;
        }
    }
    std::fs::create_dir(to.join("pictures"))?;
    for picture in files(&from.join("pictures"))? {
        std::fs::copy(&picture, to.join("pictures").join(picture.file_name().unwrap_or_default()))?;
    }
    Ok(to)
}

fn files(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("{} is missing", folder.display()))?;
    Ok(entries.filter_map(|e| e.ok().map(|e| e.path())).filter(|p| p.is_file()).collect())
}

/// A chapter as a page; its first heading is the page's title, and links go to pages.
fn page(markdown: &str) -> anyhow::Result<String> {
    let events: Vec<Event> = Parser::new_ext(markdown, Options::ENABLE_TABLES).map(to_page).collect();
    let title = title(&events);
    if title.is_empty() {
        bail!("a chapter begins with a heading");
    }
    let mut body = String::new();
    html::push_html(&mut body, events.into_iter());
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en-GB\"><head><meta charset=\"utf-8\"><title>{title}</title><style>{STYLE}</style></head>\n\
         <body>\n<p><a href=\"index.html\">Contents</a></p>\n{body}</body></html>\n"
    ))
}

/// A link to a chapter is one to its page.
fn to_page(event: Event<'_>) -> Event<'_> {
    match event {
        Event::Start(Tag::Link { link_type, dest_url, title, id }) => {
            let dest_url = dest_url.replace(".md", ".html").into();
            Event::Start(Tag::Link { link_type, dest_url, title, id })
        }
        other => other,
    }
}

fn title(events: &[Event]) -> String {
    let heading = events.iter().skip_while(|e| !matches!(e, Event::Start(Tag::Heading { .. })));
    let inside = heading.take_while(|e| !matches!(e, Event::End(TagEnd::Heading(_))));
    inside.filter_map(|e| if let Event::Text(text) = e { Some(text.as_ref()) } else { None }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_has_a_title_and_links_to_pages_and_needs_no_network() {
        let made =
            page("# What it means\n\nSee [there](report.md#size).\n\n| a | b |\n|---|---|\n| 1 | 2 |\n").unwrap();
        assert!(made.contains("<title>What it means</title>"));
        assert!(made.contains("<a href=\"report.html#size\">"));
        assert!(made.contains("<td>1</td>"));
        assert!(!made.contains("http") && !made.contains("<script"));
    }

    #[test]
    fn a_chapter_without_a_heading_is_refused() {
        assert!(page("no heading").is_err());
    }
}
