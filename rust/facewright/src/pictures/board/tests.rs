//! The board's sizes, read back from each kind of file.

use super::*;
use drawing::Format;
use std::io::Read;
use svg::parser::Event;

fn paper() -> Board {
    Board::checkerboard(9, 6, 0.0255)
}

fn plain(board: &Board) -> Result<Drawing, BoardPatternError> {
    on_page(board, Page::A4, true)
}

fn file(board: &Board, format: Format) -> Vec<u8> {
    plain(board).unwrap().encode(format, 300.0).unwrap()
}

/// Numbers of all elements of a name.
fn elements(document: &str, element: &str, names: &[&str]) -> Vec<Vec<f64>> {
    let all = svg::read(document).unwrap().filter_map(|event| match event {
        Event::Tag(name, _, attributes) if name == element => Some(attributes),
        _ => None,
    });
    all.filter_map(|a| names.iter().map(|n| a.get(*n)?.parse().ok()).collect()).collect()
}

/// The operators of a PDF's only content stream.
fn operators(pdf: &[u8]) -> String {
    let find = |needle: &[u8]| pdf.windows(needle.len()).position(|w| w == needle).unwrap();
    let packed = &pdf[find(b"stream\n") + 7..find(b"\nendstream")];
    let mut text = String::new();
    flate2::read::ZlibDecoder::new(packed).read_to_string(&mut text).unwrap();
    text
}

#[test]
fn svg_squares_are_exact_centred_and_begin_with_black() {
    let document = String::from_utf8(file(&paper(), Format::Svg)).unwrap();
    assert!(document.contains("width=\"297mm\"") && document.contains("height=\"210mm\""));
    assert!(document.contains("viewBox=\"0 0 297 210\""));
    let squares = elements(&document, "rect", &["x", "y", "width", "height"]);
    assert_eq!(squares.len(), 35);
    assert!(squares.iter().all(|s| s[2] == 25.5 && s[3] == 25.5));
    assert_eq!(squares[0][..2], [(297.0 - 255.0) / 2.0, (210.0 - 178.5) / 2.0]);
    let right = squares.iter().map(|s| s[0] + s[2]).fold(0.0, f64::max);
    assert!((right - (297.0 + 255.0) / 2.0).abs() < 1e-9);
}

#[test]
fn pdf_page_and_squares_are_exact() {
    let pdf = file(&paper(), Format::Pdf);
    let text = String::from_utf8_lossy(&pdf).into_owned();
    let numbers = text.split("/MediaBox [").nth(1).unwrap().split(']').next().unwrap();
    let page: Vec<f64> = numbers.split_whitespace().map(|n| n.parse::<f64>().unwrap() / 72.0 * 25.4).collect();
    assert!((page[2] - 297.0).abs() < 1e-4 && (page[3] - 210.0).abs() < 1e-4, "{page:?}");
    let operators = operators(&pdf);
    let scale: Vec<f64> = operators.lines().find(|l| l.ends_with(" cm")).map(numbers_of).unwrap();
    assert!((scale[0] * 25.4 / 72.0 - 1.0).abs() < 1e-7 && scale[3] == -scale[0]);
    let squares: Vec<Vec<f64>> = operators.lines().filter(|l| l.ends_with(" re")).map(numbers_of).collect();
    assert_eq!((squares.len(), &squares[0][..]), (35, &[21.0, 15.75, 25.5, 25.5][..]));
}

fn numbers_of(line: &str) -> Vec<f64> {
    line.split_whitespace().filter_map(|n| n.parse().ok()).collect()
}

#[test]
fn png_columns_are_as_far_apart_as_its_resolution_says() {
    let bytes = file(&paper(), Format::Png);
    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
    let size = reader.info().pixel_dims.unwrap();
    assert_eq!((size.xppu, size.yppu, size.unit), (11811, 11811, png::Unit::Meter));
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((frame.width, frame.height, frame.color_type), (3508, 2481, png::ColorType::Grayscale));
    let width = frame.width as usize;
    let (per_mm, middle) = (11.811, ((15.75 + 25.5 * 0.8) * 11.811) as usize);
    let row = &pixels[middle * width..(middle + 1) * width];
    // The edges to a fraction of a pixel: black from left to right until it turns.
    for k in 0..5 {
        let (from, to) = (21.0 + 51.0 * f64::from(k), 21.0 + 51.0 * f64::from(k) + 25.5);
        let around = ((from - 10.0) * per_mm) as usize..((to + 10.0) * per_mm) as usize;
        let black: f64 = row[around].iter().map(|p| 1.0 - f64::from(*p) / 255.0).sum();
        assert!((black - 25.5 * per_mm).abs() < 0.02, "{black}");
        let first = row.iter().enumerate().skip(((from - 2.0) * per_mm) as usize).find(|(_, p)| **p < 255).unwrap();
        let edge = first.0 as f64 + f64::from(*first.1) / 255.0;
        assert!((edge - from * per_mm).abs() < 0.01, "{edge} instead of {}", from * per_mm);
    }
}

#[test]
fn the_mark_lies_in_the_square_below_and_right_of_the_first_corner() {
    let separated = Board::squares(3, 4, 0.03, 0.5);
    for (board, first) in [(paper(), 1.0), (separated, 0.0)] {
        let document = String::from_utf8(file(&board, Format::Svg)).unwrap();
        let squares = elements(&document, "rect", &["x", "y", "width", "height"]);
        let discs = elements(&document, "circle", &["cx", "cy", "r"]);
        let side = side_mm(&board);
        assert_eq!(discs.len(), 1);
        let expected = [0, 1].map(|k| squares[0][k] + (first + 0.5) * side);
        assert!((discs[0][0] - expected[0]).abs() < 1e-9 && (discs[0][1] - expected[1]).abs() < 1e-9);
        assert!((discs[0][2] - 0.15 * side).abs() < 1e-9);
        assert!(squares.iter().any(|s| (s[0] - first * side - squares[0][0]).abs() < 1e-9
            && (s[1] - first * side - squares[0][1]).abs() < 1e-9));
        let bare = on_page(&board, Page::A4, false).unwrap();
        assert_eq!(bare.marks.len() + 1, plain(&board).unwrap().marks.len());
    }
}

#[test]
fn separated_squares_lie_a_gap_apart() {
    let board = Board::squares(3, 4, 0.03, 0.5);
    let document = String::from_utf8(file(&board, Format::Svg)).unwrap();
    let squares = elements(&document, "rect", &["x", "y", "width", "height"]);
    assert_eq!(squares.len(), 12);
    assert!((squares[1][0] - squares[0][0] - 45.0).abs() < 1e-9 && squares[3][1] - squares[0][1] == 45.0);
    assert!(document.contains("3x4 squares of 30 mm, 15 mm apart"));
}

#[test]
fn a_ruler_of_100_mm_lies_along_each_axis() {
    for board in [paper(), Board::checkerboard(6, 8, 0.022)] {
        let document = String::from_utf8(file(&board, Format::Svg)).unwrap();
        let lines = svg::read(&document).unwrap().filter_map(|event| match event {
            Event::Tag("polyline", _, a) => Some(a.get("points")?.to_string().replace(',', " ")),
            _ => None,
        });
        let lengths: Vec<[f64; 2]> = lines
            .map(|points| numbers_of(&points))
            .map(|p| [(p[2] - p[0]).abs(), (p[3] - p[1]).abs()])
            .filter(|d| d[0].max(d[1]) > 50.0)
            .collect();
        assert_eq!(lengths, [[100.0, 0.0], [0.0, 100.0]]);
        assert_eq!(document.matches("100 mm\n").count() + document.matches(">100 mm<").count(), 2, "{document}");
    }
}

#[test]
fn text_states_the_scale_and_a_tall_board_turns_the_page() {
    let tall = on_page(&Board::checkerboard(6, 8, 0.022), Page::Letter, true).unwrap();
    let document = String::from_utf8(tall.encode(Format::Svg, 300.0).unwrap()).unwrap();
    assert!(document.contains("6x8 inner corners, squares of 22 mm. Print at 100 %"));
    assert!(document.contains("width=\"215.9mm\""));
}

#[test]
fn a_board_too_large_names_the_page_it_fits() {
    let error = plain(&Board::checkerboard(9, 6, 0.035)).unwrap_err();
    assert!(matches!(&error, BoardPatternError::DoesNotFit { fits: Some(page), .. } if page == "A3"));
    assert!(error.to_string().contains("print on A3"), "{error}");
    for board in [Board::checkerboard(9, 6, 0.08), Board::checkerboard(4_000_000, 6, 0.003)] {
        let error = plain(&board).unwrap_err();
        assert!(error.to_string().contains("smaller or fewer squares"), "{error}");
    }
}

#[test]
fn impossible_boards_are_refused() {
    let boards = [
        Board::checkerboard(2, 6, 0.025),
        Board::checkerboard(9, 6, 0.0),
        Board::checkerboard(9, 6, f64::NAN),
        Board::checkerboard(9, 6, 0.0029),
        Board::squares(3, 0, 0.03, 1.0),
        Board::squares(3, 4, 0.03, 0.0),
        Board::squares(3, 4, 0.03, f64::NAN),
    ];
    for board in boards {
        let error = plain(&board).unwrap_err();
        assert!(matches!(error, BoardPatternError::Impossible { .. }), "{error}");
    }
}
