"""The arm beside its peers: following hands, plans, clearance, what it costs."""
