use super::*;

fn refusal(names: &[&str], method: &Method, headers: &[(&'static str, &str)]) -> Option<&'static str> {
    refusal_at("127.0.0.1:7480", names, method, headers)
}

fn refusal_at(
    listen: &str,
    names: &[&str],
    method: &Method,
    headers: &[(&'static str, &str)],
) -> Option<&'static str> {
    let names = names.iter().map(|&name| name.to_owned()).collect();
    let hosts = Hosts::new(listen.parse().unwrap(), names);
    let headers =
        headers.iter().map(|(name, value)| (name.parse().unwrap(), value.parse().unwrap())).collect();
    hosts.refusal(method, &headers)
}

#[test]
fn this_machine_may_ask_under_each_of_its_names() {
    for host in ["127.0.0.1:7480", "127.0.0.1", "localhost:7480", "localhost", "[::1]:7480", "[::1]"] {
        assert_eq!(refusal(&[], &Method::GET, &[("host", host)]), None, "{host}");
    }
}

#[test]
fn a_name_that_only_points_here_is_refused_unless_it_is_ours() {
    for host in [
        "evil.example:7480",
        "evil.example",
        "localhost.evil.example",
        "127.0.0.1.evil.example",
        "192.0.2.1:7480",
        "",
    ] {
        assert!(refusal(&[], &Method::GET, &[("host", host)]).is_some(), "{host}");
    }
    assert!(refusal(&[], &Method::GET, &[]).is_some());
    assert_eq!(refusal(&["lab.example"], &Method::GET, &[("host", "Lab.example:80")]), None);
}

#[test]
fn commands_come_from_the_own_page_only() {
    let own = ("host", "127.0.0.1:7480");
    let post = |more: &[(&'static str, &str)]| refusal(&[], &Method::POST, &[&[own], more].concat());
    assert_eq!(post(&[]), None, "a program of this machine, which reaches the bus anyway");
    assert_eq!(post(&[("origin", "http://127.0.0.1:7480"), ("sec-fetch-site", "same-origin")]), None);
    for origin in ["http://evil.example", "null", "http://127.0.0.1:8000", "http://localhost:7480"] {
        assert!(post(&[("origin", origin)]).is_some(), "{origin}");
    }
    for site in ["cross-site", "same-site", "none"] {
        assert!(post(&[("sec-fetch-site", site)]).is_some(), "{site}");
    }
}

#[test]
fn a_proxy_in_front_and_a_place_on_every_network_are_known() {
    let proxied = [("host", "127.0.0.1:7480"), ("origin", "https://lab.example")];
    assert!(refusal(&[], &Method::POST, &proxied).is_some());
    assert_eq!(refusal(&["lab.example"], &Method::POST, &proxied), None);
    let said = [&proxied[..], &[("sec-fetch-site", "same-origin")]].concat();
    assert_eq!(refusal(&[], &Method::POST, &said), None);
    let by_address = [("host", "192.0.2.1:7480")];
    assert_eq!(refusal_at("0.0.0.0:7480", &[], &Method::GET, &by_address), None);
    assert!(refusal_at("0.0.0.0:7480", &[], &Method::GET, &[("host", "elsewhere.example")]).is_some());
}

#[cfg(feature = "foxglove")]
#[test]
fn pages_of_other_sites_do_not_even_look_at_the_live_channels() {
    let hosts = Hosts::new("127.0.0.1:7480".parse().unwrap(), Vec::new());
    let foreign = |origin: &str| {
        let headers = [(header::ORIGIN, origin.parse().unwrap())].into_iter().collect();
        hosts.foreign_page(&headers, &["https://viewer.example".to_owned()]).map(str::to_owned)
    };
    for origin in ["https://viewer.example", "http://127.0.0.1:7480", "http://localhost:8080"] {
        assert_eq!(foreign(origin), None, "{origin}");
    }
    for origin in ["https://evil.example", "null", "file://", "https://viewer.example.evil.example"] {
        assert_eq!(foreign(origin).as_deref(), Some(origin));
    }
    assert_eq!(hosts.foreign_page(&HeaderMap::new(), &[]), None, "a program of this machine");
}
