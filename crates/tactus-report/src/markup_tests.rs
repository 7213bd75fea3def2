use super::Text;

#[test]
fn markup_is_escaped_in_text_and_attributes() {
    let hostile = "<script>alert(\"1\" & '2')</script>\u{1b}[31m";
    let safe = "&lt;script&gt;alert(&quot;1&quot; &amp; &#39;2&#39;)&lt;/script&gt;\u{fffd}[31m";
    assert_eq!(Text(hostile).to_string(), safe);
    assert_eq!(Text(1.5).to_string(), "1.5");
}
