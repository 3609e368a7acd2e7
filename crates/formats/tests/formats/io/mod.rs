mod asset_root;
