use super::without_places;

#[test]
fn messages_name_no_folder_of_the_machine_that_built_zenoh() {
    let text = "Unable to connect at /home/builder/.cargo/registry/src/zenoh-1.10.2/src/net/mod.rs:321. - Caused by \
                refused (no route at C:\\zenoh\\link.rs:7.)";
    assert_eq!(without_places(text), "Unable to connect - Caused by refused (no route)");
    let plain = "no link at tcp/127.0.0.1:7447 is up.";
    assert_eq!(without_places(plain), plain);
}
