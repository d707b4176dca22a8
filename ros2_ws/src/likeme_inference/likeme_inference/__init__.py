"""Goal inference, action selection and requests for help after Chung et al. (2015)."""
