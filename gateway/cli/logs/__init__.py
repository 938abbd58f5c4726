"""Commands that tell from recorded logs what a service would have told."""
