//! What drivers read from the environment.

/// Keeps a layer of Vulkan's from printing an error on machines without a display: it asks the display which graphics
/// card is its own, also where none is to be drawn to. gmlc chooses the card itself.
///
/// Called first of all in `main`.
pub fn without_display() {
    let is_set = |name: &str| std::env::var_os(name).is_some();
    // With a display, or a card that the user has chosen, the layer has its use.
    if is_set("XDG_RUNTIME_DIR") || is_set("MESA_VK_DEVICE_SELECT") {
        return;
    }
    // SAFETY: no other thread runs yet that could read the environment meanwhile.
    unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
}
