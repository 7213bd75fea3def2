use super::*;

#[test]
fn what_the_system_allows_is_allowed() {
    let Rlimit { maximum, .. } = getrlimit(Resource::Nofile);
    let few = Rlimit { current: maximum.map_or(Some(256), |files| Some(files.min(256))), maximum };
    setrlimit(Resource::Nofile, few).unwrap();
    allow_all();
    assert_eq!(getrlimit(Resource::Nofile), Rlimit { current: maximum, maximum });
}
